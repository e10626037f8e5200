#include "pipeline/job/options.h"

#include <gtest/gtest.h>

#include "io/errors/errors.h"
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
  void expect_refused(const EncodeOptions& options) {
    EXPECT_THROW(encode_volume(path("in.nrrd"), {}, path("b.tag"), true, options, Resources(1)), UsageError);
  }
};

TEST_F(Options, WhatIsAcceptedDecodes) {
  const double numbers[] = {0, 0.3, 1, 2.3, 2.7, 3, 70000, 1e19, 1e300};
  for (const double a : numbers)
    for (const double b : numbers)
      for (const bool grid : {false, true}) {
        EncodeOptions options;
        options.cube_size = 4;
        options.max_error = a;
        options.grid_only = grid;
        EncodeOptions with_surface = options, with_mesh = options;
        with_surface.surface_error = b;
        with_mesh.mesh_error = b;
        expect_refused_or_whole(with_surface);
        expect_refused_or_whole(with_mesh);
      }
  for (const int brick : {1, 2, 127, 128, 129, 1 << 26, 1 << 27, (1 << 27) + 1})
    for (const int cube : {4, 64, 256}) {
      EncodeOptions options;
      options.cube_size = cube;
      options.brick_edge = brick;
      expect_refused_or_whole(options);
    }
  for (const double low : {-1e308, -1.0, 0.0, 1e-320})
    for (const double high : {1e308, 1.0, 1e-320, 5.0}) {
      EncodeOptions options;
      options.range = {low, high};
      expect_refused_or_whole(options);
    }
}

TEST_F(Options, BoundsThatAreEqualInWholeUnitsAreRefused) {
  EncodeOptions options;
  options.max_error = 2.7;
  options.surface_error = 2.3;
  expect_refused(options);
}

TEST_F(Options, ALooserMeshBoundNeverMakesMorePointsActive) {
  std::uint64_t before = ~std::uint64_t{0};
  for (const double bound : {0.0, 1.0, 5.0, 50.0, 1e6, 1e19}) {
    EncodeOptions options;
    options.cube_size = 4;
    options.mesh_error = bound;
    encode_volume(path("in.nrrd"), {}, path("a.tag"), true, options, Resources(1));
    const std::uint64_t active = verify_file(path("a.tag"), "", {}, Resources(1)).active_points;
    EXPECT_LE(active, before) << bound;
    before = active;
  }
}

}  // namespace
}  // namespace tagrid
