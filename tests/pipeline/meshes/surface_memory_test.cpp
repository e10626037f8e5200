// Making a surface takes no more memory than the plan says.
#include <gtest/gtest.h>

#include "io/errors/errors.h"
#include "io/tag/bricks.h"
#include "pipeline/memory/of_bricks.h"
#include "pipeline/meshes/surface_builder.h"
#include "stages/grid/lattice.h"
#include "tests/support/counted_heap.h"
#include "tests/support/runs.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

class SurfaceToNowhere : public SurfaceSink {
 public:
  void add(const SurfacePiece&) override {}
};

class SurfaceMemory : public TemporaryFolder {
 protected:
  void SetUp() override {
    if (sanitized) GTEST_SKIP() << "a sanitizer allocates in its own way";
  }
  // Noise around the level, in which nearly every point is active.
  void encode(bool grid_only, int cube) {
    const Index3 dims{70, 60, 50};
    write_nrrd(path("in.nrrd"), dims, blobs<std::int16_t>(dims, 2, 100));
    EncodeOptions options;
    options.cube_size = cube;
    options.brick_edge = 2;
    options.grid_only = grid_only;
    options.range = {20, 120};
    encode_volume(path("in.nrrd"), {}, path("in.tag"), true, options, Resources(1));
  }
};

TEST_F(SurfaceMemory, OfAWholeSurfaceAndOfARegionIsWithinThePlan) {
  for (const bool grid_only : {false, true})
    for (const int cube : {8, 16}) {
      encode(grid_only, cube);
      SurfaceToNowhere sink;
      for (const bool region : {false, true}) {
        const TagBricks file(std::make_shared<FileSource>(path("in.tag")));
        const CodingParameters& p = file.parameters();
        SurfacePart part{max_level(cube)};
        if (region) part.box = Box{{3, 3, 3}, {44, 49, 30}};
        const Box positions = bricks_that_meet(part.box, p.bricks());
        const std::uint64_t of_builder = SurfaceBuilder::working_bytes(p, positions);
        TagReader reader(path("in.tag"));
        const std::uint64_t stated = region ? memory_of_taking(p, positions, of_builder, 1)
                                            : plan_taking(p, of_builder, Resources(1)).memory;
        const HeapPeak peak;
        SurfaceBuilder builder(file.header(), positions, part, {70}, sink);
        if (region)
          take_some(file, positions, of_builder, Resources(1), builder);
        else
          take_all(reader, of_builder, Resources(1), builder);
        EXPECT_GT(builder.counts().triangles, 10000);
        EXPECT_LE(peak.bytes(), stated - memory_of_program) << grid_only << ", " << cube << ", " << region;
      }
    }
}

TEST_F(SurfaceMemory, ALimitBelowThePlanIsRefused) {
  encode(false, 8);
  Resources tight(1);
  tight.memory = memory_of_program + 100000;
  EXPECT_THROW(write_surface(path("in.tag"), path("x.ply"), {.iso = 70}, tight), MemoryLimit);
  WantedRegion region;
  region.low[0] = 20;
  EXPECT_THROW(write_surface(path("in.tag"), path("x.ply"), {.iso = 70, .region = region}, tight),
               MemoryLimit);
}

}  // namespace
}  // namespace tagrid
