// Options of an encoding, for narrow and wide types.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "io/errors/errors.h"
#include "pipeline/job/options.h"
#include "tests/support/awkward_volumes.h"
#include "tests/support/runs.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

class Options : public TemporaryFolder {
 protected:
  Options() { write_nrrd(path("in.nrrd"), {9, 8, 7}, blobs<std::int16_t>({9, 8, 7}, 1)); }

  // Every encoded file decodes; options that would not decode are refused before anything is written.
  void expect_refused_or_whole(const EncodeOptions& options) {
    try {
      encode_volume(path("in.nrrd"), {}, path("a.tag"), true, options, Resources(1));
    } catch (const UsageError&) {
      return;
    }
    EXPECT_NO_THROW(verify_file(path("a.tag"), path("in.nrrd"), {}, Resources(1)));
  }
};

TEST_F(Options, WhatIsAcceptedDecodes) {
  const double numbers[] = {0, 0.3, 1, 2.3, 2.7, 3, 70000, 1e19, 1e300};
  for (const double a : numbers)
    for (const double b : numbers)
      for (const bool grid : {false, true}) {
        EncodeOptions options{.grid_only = grid, .max_error = a, .cube_size = 4};
        EncodeOptions with_surface = options, with_mesh = options;
        with_surface.surface_error = b;
        with_mesh.mesh_error = b;
        expect_refused_or_whole(with_surface);
        expect_refused_or_whole(with_mesh);
      }
  for (const int brick : {1, 2, 127, 128, 129, 1 << 26, 1 << 27, (1 << 27) + 1})
    for (const int cube : {4, 64, 256}) {
      EncodeOptions options{.cube_size = cube, .brick_edge = brick};
      expect_refused_or_whole(options);
    }
  for (const double low : {-1e308, -1.0, 0.0, 1e-320})
    for (const double high : {1e308, 1.0, 1e-320, 5.0}) {
      EncodeOptions options{.range = {{low, high}}};
      expect_refused_or_whole(options);
    }
}

TEST_F(Options, BoundsThatAreEqualInWholeUnitsAreRefused) {
  const EncodeOptions options{.max_error = 2.7, .surface_error = 2.3};
  EXPECT_THROW(encode_volume(path("in.nrrd"), {}, path("b.tag"), true, options, Resources(1)), UsageError);
}

TEST_F(Options, ALooserMeshBoundNeverMakesMorePointsActive) {
  std::uint64_t before = ~std::uint64_t{0};
  for (const double bound : {0.0, 1.0, 5.0, 50.0, 1e6, 1e19}) {
    EncodeOptions options{.mesh_error = bound, .cube_size = 4};
    encode_volume(path("in.nrrd"), {}, path("a.tag"), true, options, Resources(1));
    const std::uint64_t active =
        verify_file(path("a.tag"), std::nullopt, {}, Resources(1)).active_points.value();
    EXPECT_LE(active, before) << bound;
    before = active;
  }
}

// Special cases of the options for 32-bit integers and floats.

class WideOptions : public TemporaryFolder {
 protected:
  const Index3 dims_{12, 9, 10};
  const std::string in_ = path("in.nrrd"), tag_ = path("a.tag");

  template <class T>
  CodingParameters encode(const std::vector<T>& samples, const EncodeOptions& options = {}) {
    write_nrrd(in_, dims_, samples);
    encode_volume(in_, {}, tag_, true, options, Resources(1));
    return verify_file(tag_, in_, {}, Resources(1)).header.parameters;
  }
};

TEST_F(WideOptions, TheRangeOfAFileIsThatOfItsFiniteSamples) {
  auto samples = awkward_volume<float>(Awkward::not_finite_blobs, dims_, 1);
  samples[0] = -70.5F;
  samples[9] = 812;
  const CodingParameters p = encode(samples);
  EXPECT_EQ(p.range_low, -70.5);
  EXPECT_EQ(p.range_high, 812);
  EXPECT_EQ(p.field_scale, 8 / (812 + 70.5));
  const std::vector<std::uint32_t> whole(samples.size(), 4294967295U);
  EXPECT_EQ(encode(whole).range_low, 4294967295.0);
}

TEST_F(WideOptions, EveryRangeOfDataGivesAFieldScale) {
  constexpr double most = std::numeric_limits<double>::max(),
                   least = std::numeric_limits<double>::denorm_min();
  const double nan = std::nan("");
  for (const auto& [a, b] : {std::pair{-most, most},
                             {0.0, least},
                             {most, most},
                             {nan, nan},
                             {nan, INFINITY},
                             {1e20, 1e20},
                             {-0.0, 0.0},
                             {1.0, std::nextafter(1.0, 2.0)}}) {
    std::vector<double> samples(static_cast<std::size_t>(Box::of_size(dims_).count()), a);
    samples[5] = b;
    const CodingParameters p = encode(samples);
    EXPECT_GT(p.field_scale, 0) << a << " " << b;
    EXPECT_TRUE(std::isfinite(p.field_scale)) << a << " " << b;
  }
}

TEST_F(WideOptions, BoundsOfFloatsAreNotRounded) {
  const auto samples = awkward_volume<double>(Awkward::smooth, dims_, 1);
  EncodeOptions options{.max_error = 0.7, .surface_error = 0.6, .mesh_error = 0.65};
  const CodingParameters p = encode(samples, options);
  EXPECT_EQ(p.max_error, 0.7);
  EXPECT_EQ(p.surface_error, 0.6);
  EXPECT_EQ(p.mesh_error, 0.65);
  write_nrrd(in_, dims_, awkward_volume<std::int32_t>(Awkward::smooth, dims_, 1));
  EXPECT_THROW(encode_volume(in_, {}, tag_, true, options, Resources(1)), UsageError);
}

// The adaptive grid of floats and 32-bit integers is the same as that of the same numbers in 16 bits: bit by
// bit, as the field scale is a power of two.
TEST_F(WideOptions, TheGridDoesNotDependOnTheTypeOfTheSamples) {
  const auto narrow = blobs<std::int16_t>(dims_, 3);
  EncodeOptions options{.cube_size = 4, .range = {{0, 128}}};
  const auto active = [&](const auto& samples, const EncodeOptions& with) {
    encode(samples, with);
    return verify_file(tag_, in_, {}, Resources(1)).index.total.active;
  };
  const auto same_as_narrow = [&](const EncodeOptions& with) {
    const auto expected = active(narrow, with);
    EXPECT_EQ(active(std::vector<std::int32_t>(narrow.begin(), narrow.end()), with), expected);
    EXPECT_EQ(active(std::vector<std::uint32_t>(narrow.begin(), narrow.end()), with), expected);
    EXPECT_EQ(active(std::vector<float>(narrow.begin(), narrow.end()), with), expected);
    EXPECT_EQ(active(std::vector<double>(narrow.begin(), narrow.end()), with), expected);
  };
  same_as_narrow(options);
  options.mesh_error = 10;
  options.max_error = 4;
  EXPECT_EQ(active(std::vector<std::int32_t>(narrow.begin(), narrow.end()), options),
            active(narrow, options));
}

}  // namespace
}  // namespace tagrid
