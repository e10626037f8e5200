// Making a mesh takes no more memory than the plan says, and the plan does not say much more.
#include <gtest/gtest.h>

#include "io/tag/bricks.h"
#include "pipeline/memory/of_bricks.h"
#include "pipeline/meshes/mesh_bricks.h"
#include "stages/grid/lattice.h"
#include "tests/support/brick_samples.h"
#include "tests/support/counted_heap.h"
#include "tests/support/runs.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

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
  const Index3 dims{60, 50, 40};
  write_nrrd(path("in.nrrd"), dims, blobs<std::int16_t>(dims, 2, 300));
  for (const bool grid_only : {false, true})
    for (const int cube : {4, 16}) {
      EncodeOptions options;
      options.cube_size = cube;
      options.brick_edge = 2;
      options.grid_only = grid_only;
      encode_volume(path("in.nrrd"), {}, path("in.tag"), true, options, Resources(1));
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
  const Index3 dims{70, 60, 50};
  write_nrrd(path("in.nrrd"), dims, blobs<std::int16_t>(dims, 2, 300));
  for (const bool grid_only : {false, true}) {
    EncodeOptions options;
    options.cube_size = 8;
    options.grid_only = grid_only;
    encode_volume(path("in.nrrd"), {}, path("in.tag"), true, options, Resources(1));
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

}  // namespace
}  // namespace tagrid
