// Options and headers agree on what a bound is.
#include <gtest/gtest.h>

#include <cmath>

#include "io/errors/errors.h"
#include "io/tag/header.h"
#include "pipeline/job/options.h"

namespace tagrid {
namespace {

constexpr std::optional<double> EncodeOptions::*options[] = {
    &EncodeOptions::max_error, &EncodeOptions::surface_error, &EncodeOptions::mesh_error};
constexpr double CodingParameters::*parameters[] = {
    &CodingParameters::max_error, &CodingParameters::surface_error, &CodingParameters::mesh_error};

EncodeOptions options_with(std::size_t which, double bound) {
  EncodeOptions result;
  result.max_error = 1000;
  result.*options[which] = bound;
  return result;
}
Status check_with(std::size_t which, double bound) {
  CodingParameters p;
  p.dims = {4, 4, 4};
  p.field_scale = 1;
  p.max_error = 1000;
  p.*parameters[which] = bound;
  return check_parameters(p);
}

TEST(Bounds, AreNumbersFromZeroInOptionsAndInHeaders) {
  for (std::size_t which = 0; which < 3; ++which) {
    for (const double bound : {0.0, 0.5, 999.0}) {
      EXPECT_NO_THROW(options_with(which, bound).validate()) << which;
      EXPECT_TRUE(check_with(which, bound).ok()) << which;
    }
    for (const double bound : {-2.0, -0.5, std::nan(""), double{INFINITY}, -double{INFINITY}}) {
      EXPECT_THROW(options_with(which, bound).validate(), UsageError) << which;
      EXPECT_FALSE(check_with(which, bound).ok()) << which;
    }
  }
}

TEST(Bounds, ThatAreAbsentAreMinusOneInHeadersOnly) {
  for (std::size_t which = 0; which < 3; ++which)
    EXPECT_THROW(options_with(which, -1).validate(), UsageError);
  EXPECT_FALSE(check_with(0, -1).ok()) << "a file with voxels has a bound";
  EXPECT_TRUE(check_with(1, -1).ok());
  EXPECT_TRUE(check_with(2, -1).ok());
}

}  // namespace
}  // namespace tagrid
