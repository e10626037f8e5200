// Air and bounds of an encoding.
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "io/errors/errors.h"
#include "io/tag/header.h"
#include "pipeline/encode/graph.h"
#include "pipeline/job/options.h"
#include "stages/activity/coding.h"
#include "stages/criterion/mesh_criterion.h"
#include "tests/support/encode_volume.h"
#include "tests/support/graph_ends.h"

namespace tagrid {
namespace {

// Options and headers agree on what a bound is.

constexpr std::optional<double> EncodeOptions::*options[] = {
    &EncodeOptions::max_error, &EncodeOptions::surface_error, &EncodeOptions::mesh_error};
constexpr double CodingParameters::*parameters[] = {
    &CodingParameters::max_error, &CodingParameters::surface_error, &CodingParameters::mesh_error};

EncodeOptions options_with(std::size_t which, double bound) {
  EncodeOptions result{.max_error = 1000};
  result.*options[which] = bound;
  return result;
}
Status check_with(std::size_t which, double bound) {
  CodingParameters p{.dims = {4, 4, 4}, .field_scale = 1, .max_error = 1000};
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

// Stages skip air, and the grid is the same as if they did not.

CodingParameters parameters_of(double mesh_error) {
  CodingParameters p{.dims = {60, 33, 41},
                     .type = SampleType::int16,
                     .mode = FileMode::grid,
                     .cube_size = 8,
                     .brick_edge = 1,
                     .max_level = 9,
                     .field_scale = 0.1,
                     .max_error = -1,
                     .mesh_error = mesh_error};
  return p;
}

// A ball in air, a speck at the corner of a tile, and one that only the halo of the tiles around contains.
oracle::Volume<std::int16_t> air_with_things(Index3 dims) {
  return oracle::volume_of<std::int16_t>(dims, [](std::int64_t x, std::int64_t y, std::int64_t z) {
    const Index3 p{x, y, z}, d = p - Index3{20, 12, 13};
    const bool speck = p == Index3{48, 24, 32} || p == Index3{55, 4, 4};
    return static_cast<std::int16_t>(d.x * d.x + d.y * d.y + d.z * d.z < 20 ? 300 : speck ? -950 : -1000);
  });
}

// The marks of all points at once.
LatticeBits all_marks(const oracle::Volume<std::int16_t>& volume, const CodingParameters& p) {
  LatticeBits marks = marks_of(volume, p.cube_size, {p.accuracy, p.field_scale, p.max_level});
  if (p.mesh_error < 0) return marks;
  const Box read = marks.box().grown(mesh_criterion_halo(p.cube_size));
  const std::vector<std::int16_t> samples = volume.cut(read);
  mark_mesh_error(Samples<std::int16_t>{read, samples.data()}, p.domain(), mesh_bounds(p), marks);
  return marks;
}

class Air : public testing::TestWithParam<double> {};

TEST_P(Air, HasTheGridOfTheWholeVolumeAtOnce) {
  const CodingParameters parameters = parameters_of(GetParam());
  const BrickGrid bricks = parameters.bricks();
  const auto volume = air_with_things(parameters.dims);
  auto slices = slices_of(volume.dims, volume.samples);
  std::map<std::int64_t, std::vector<std::uint8_t>> activity;
  BricksInto sink([&](const BrickBytes& brick, const Statistics&) { activity[brick.id] = brick.activity; });
  Watch unwatched;
  encode(job_of(parameters, 2), BrickRows::all(bricks), slices, sink, unwatched);

  LatticeBits active = all_marks(volume, parameters);
  close_under_parents(active, parameters.cube_size);
  std::int64_t only_corners = 0;
  for (std::int64_t id = 0; id < bricks.count(); ++id) {
    LatticeBits part(bricks.closed_box(bricks.position(id)));
    copy_bits(active, part);
    only_corners += count_of(part) == 8;
    std::vector<std::uint8_t> expected;
    encode_activity(part, {}, parameters.cube_size, parameters.max_level, expected);
    EXPECT_EQ(activity[id], expected) << "brick " << id;
  }
  EXPECT_GT(only_corners, 0) << "there is no air";
  EXPECT_LT(only_corners, bricks.count());
}

INSTANTIATE_TEST_SUITE_P(WithoutAndWithABoundOfTheMesh, Air, testing::Values(-1.0, 0.0, 40.0));

}  // namespace
}  // namespace tagrid
