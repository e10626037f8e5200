// Memory that meshes and surfaces take.
#include "io/errors/errors.h"
#include "io/tag/bricks.h"
#include "pipeline/memory/plan.h"
#include "pipeline/meshes/coarsened_grid.h"
#include "pipeline/meshes/mesh_builder.h"
#include "pipeline/meshes/surface_builder.h"
#include "stages/grid/lattice.h"
#include "tests/support/brick_samples.h"
#include "tests/support/counted_heap.h"
#include "tests/support/runs.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

// Making a mesh takes no more memory than the plan says, and the plan does not say much more.

class Nowhere : public MeshSink {
 public:
  void add_points(std::span<const double>, std::span<const std::byte>) override {}
  void add_tetrahedra(std::span<const std::int64_t>, std::span<const std::uint8_t>) override {}
};

class MeshMemory : public TemporaryFolder {
 protected:
  void SetUp() override {
    if (sanitized) GTEST_SKIP() << "a sanitizer allocates in its own way";
  }
  /// Makes in.tag, of noise.
  void encode(Index3 dims, const EncodeOptions& options, int noise = 300) const {
    write_nrrd(path("in.nrrd"), dims, blobs<std::int16_t>(dims, 2, noise));
    encode_volume(path("in.nrrd"), {}, path("in.tag"), true, options, Resources(1));
  }
  static MeshPart all_of(const CodingParameters& parameters) { return {max_level(parameters.cube_size)}; }
};

TEST_F(MeshMemory, OfABuilderIsWhatItStates) {
  for (const SampleType type : {SampleType::uint8, SampleType::int16, SampleType::float64})
    for (const int cube : {8, 32}) {
      TagHeader header;
      CodingParameters& p = header.parameters;
      p.type = type;
      p.cube_size = cube;
      p.dims = {4 * cube - 3, 4 * cube - 3, 2 * cube - 3};
      const BrickGrid bricks = p.bricks();
      const MeshPart part = all_of(p);
      LatticeBits everything(p.domain().padded());
      for (std::uint64_t& word : everything.words()) word = ~std::uint64_t{0};
      const double value = 0;
      Nowhere sink;
      const HeapPeak peak;
      MeshBuilder builder(header, bricks_that_meet(part.box, bricks), part, sink);
      for (std::int64_t id = 0; id < bricks.count(); ++id) {
        const LatticeBits active = cut(everything, bricks.closed_box(bricks.position(id)));
        builder.add_brick(bricks.position(id), active,
                          [&](Index3) { return reinterpret_cast<const std::byte*>(&value); });
      }
      const std::uint64_t of_cut = LatticeBits::working_bytes(bricks.closed_box({0, 0, 0}).size());
      const std::uint64_t stated =
          MeshBuilder::working_bytes(p, bricks_that_meet(part.box, bricks)) + 2 * of_cut + 4096;
      EXPECT_LE(peak.bytes(), stated) << name_of(type) << ", " << cube;
      EXPECT_LE(stated, 2 * peak.bytes()) << name_of(type) << ", " << cube;
    }
}

TEST_F(MeshMemory, OfABoxIsWithinItsPlan) {
  for (const bool grid_only : {false, true})
    for (const int cube : {4, 16}) {
      encode({60, 50, 40}, {.grid_only = grid_only, .cube_size = cube, .brick_edge = 2});
      const TagBricks file(std::make_shared<FileSource>(path("in.tag")));
      MeshPart part = all_of(file.parameters());
      part.box = Box{{3, 3, 3}, {44, 49, 30}};
      const Box positions = bricks_that_meet(part.box, file.parameters().bricks());
      const std::uint64_t of_builder = MeshBuilder::working_bytes(file.parameters(), positions),
                          stated = memory_of_taking(file.parameters(), positions, of_builder, 1);
      Nowhere sink;
      const HeapPeak peak;
      build_box<MeshBuilder>(file, part, Resources(1), {}, sink);
      EXPECT_LE(peak.bytes(), stated - memory_of_program) << grid_only << ", " << cube;

      Resources tight(4);
      tight.memory = stated - 1;
      EXPECT_THROW(build_box<MeshBuilder>(file, part, tight, {}, sink), MemoryLimit);
      tight.memory = stated;
      EXPECT_NO_THROW(build_box<MeshBuilder>(file, part, tight, {}, sink));
    }
}

TEST_F(MeshMemory, OfAWholeMeshIsWithinItsPlan) {
  for (const bool grid_only : {false, true}) {
    encode({70, 60, 50}, {.grid_only = grid_only, .cube_size = 8});
    TagReader reader(path("in.tag"));
    const CodingParameters& p = reader.parameters();
    const std::uint64_t of_builder = MeshBuilder::working_bytes(p, bricks_that_meet({}, p.bricks())),
                        stated = plan_taking(p, of_builder, Resources(1)).memory;
    Nowhere sink;
    const HeapPeak peak;
    build_all<MeshBuilder>(reader, all_of(p), Resources(1), {}, sink);
    EXPECT_LE(peak.bytes(), stated - memory_of_program) << grid_only;
  }
}

// Coarsening takes no more memory than its plan says, whatever the height of the volume.

class CoarseningMemory : public MeshMemory {
 protected:
  // The peak of the heap, and what the plan says.
  std::pair<std::uint64_t, std::uint64_t> coarsen(int threads) const {
    TagReader reader(path("in.tag"));
    const CodingParameters& p = reader.parameters();
    const BrickGrid bricks = p.bricks();
    Resources resources(threads);
    resources.memory = std::uint64_t{1} << 32;
    const CoarseningPlan plan = plan_coarsening(p, 0, resources);
    EXPECT_EQ(plan.threads, threads);
    std::int64_t active = 0;
    const HeapPeak peak;
    coarsen_file(reader, {p.domain().volume(), p.cube_size, 20, false},
                 Box::of_size({bricks.bricks(0), bricks.bricks(1), bricks.bricks(2)}), path("x"), 0,
                 resources, [&](Index3, const LatticeBits& bits, const auto&) {
                   for (const std::uint64_t word : bits.words()) active += std::popcount(word);
                 });
    EXPECT_GT(active, 20000);
    return {peak.bytes(), plan.decoding.memory - memory_of_program};
  }
};

TEST_F(CoarseningMemory, IsWithinThePlan) {
  for (const int cube_size : {8, 32}) {
    encode({70, 60, 90}, {.cube_size = cube_size}, 60);
    for (const int threads : {1, 3}) {
      const auto [peak, stated] = coarsen(threads);
      EXPECT_LE(peak, stated) << cube_size << ", " << threads;
    }
  }
}

TEST_F(CoarseningMemory, DoesNotGrowWithTheHeight) {
  encode({24, 24, 900}, {.cube_size = 8}, 60);
  const std::uint64_t low = coarsen(1).first;
  encode({24, 24, 2700}, {.cube_size = 8}, 60);
  EXPECT_LT(coarsen(1).first, low + low / 4);
}

TEST_F(CoarseningMemory, ATightLimitMeansFewerThreads) {
  encode({70, 60, 90}, {}, 60);
  const TagReader reader(path("in.tag"));
  Resources resources(8);
  resources.memory = std::uint64_t{1} << 32;
  resources.memory = plan_coarsening(reader.parameters(), 0, resources).decoding.memory;
  EXPECT_EQ(plan_coarsening(reader.parameters(), 0, resources).threads, 8);
  Resources one(1);
  one.memory = resources.memory;
  resources.memory = plan_coarsening(reader.parameters(), 0, one).decoding.memory;
  const CoarseningPlan plan = plan_coarsening(reader.parameters(), 0, resources);
  EXPECT_LT(plan.threads, 8);
  EXPECT_LE(plan.decoding.memory, *resources.memory);
}

// Making a surface takes no more memory than the plan says.

class SurfaceToNowhere : public SurfaceSink {
 public:
  void add(const SurfacePiece&) override {}
};

class SurfaceMemory : public MeshMemory {
 protected:
  // Noise around the level, in which nearly every point is active.
  void make_noise(bool grid_only, int cube) const {
    encode({70, 60, 50}, {.grid_only = grid_only, .cube_size = cube, .brick_edge = 2, .range = {{20, 120}}},
           100);
  }
};

TEST_F(SurfaceMemory, OfAWholeSurfaceAndOfARegionIsWithinThePlan) {
  for (const bool grid_only : {false, true})
    for (const int cube : {8, 16}) {
      make_noise(grid_only, cube);
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
  make_noise(false, 8);
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
