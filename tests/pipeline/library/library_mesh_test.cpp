// The mesh through callbacks: the same as that of the program, and parts of it.
#include "tests/pipeline/library/library_calls.h"
#include "tests/support/awkward_volumes.h"
#include "tests/support/runs.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"
#include "tests/support/vtu_reader.h"

namespace tagrid {
namespace {

struct Taken {
  std::vector<double> points;
  std::vector<std::int16_t> values;
  std::vector<std::int64_t> tetrahedra;
  std::vector<std::uint8_t> levels;
  int calls = 0, fails_at = -1;

  tagrid_mesh_sink sink() {
    tagrid_mesh_sink sink;
    tagrid_mesh_sink_init(&sink);
    sink.user = this;
    sink.points = [](void* user, size_t count, const double* xyz, const void* more) {
      auto& taken = *static_cast<Taken*>(user);
      const auto* first = static_cast<const std::int16_t*>(more);
      taken.points.insert(taken.points.end(), xyz, xyz + 3 * count);
      taken.values.insert(taken.values.end(), first, first + count);
      return taken.calls++ == taken.fails_at ? 1 : 0;
    };
    sink.tetrahedra = [](void* user, size_t count, const int64_t* ids, const uint8_t* at) {
      auto& taken = *static_cast<Taken*>(user);
      taken.tetrahedra.insert(taken.tetrahedra.end(), ids, ids + 4 * count);
      taken.levels.insert(taken.levels.end(), at, at + count);
      return taken.calls++ == taken.fails_at ? 1 : 0;
    };
    return sink;
  }
};

struct LibraryMesh : TemporaryFolder {};

TEST_F(LibraryMesh, TheMeshIsThatOfTheProgramWholeAndInPart) {
  const Index3 dims = {19, 14, 17};
  const auto samples = blobs<std::int16_t>(dims, 1);
  const tagrid_box box = {{3, 2, 5}, {14, 13, 12}};
  for (const auto& [grid_only, is_part] :
       {std::pair(false, false), {true, false}, {false, true}, {true, true}})
    for (const bool padded : {false, true})
      for (const int level : {-1, 2}) {
        MemoryFile memory = encoded_file(dims, samples, grid_only);
        file("volume.tag", memory.bytes);
        MeshOptions same;
        if (level >= 0) same.level = level;
        same.padded = padded;
        same.overwrite = true;
        if (is_part) same.region.low = {3, 2, 5}, same.region.high = {14, 13, 12};
        write_mesh(path("volume.tag"), path("mesh.vtu"), same, Resources(2));
        Vtu vtu(path("mesh.vtu"));

        Taken taken;
        const tagrid_mesh_sink sink = taken.sink();
        tagrid_mesh_options options = mesh_options(is_part ? &box : nullptr);
        options.level = level;
        options.padded = padded;
        const ReaderHandle reader = open_reader(memory);
        ASSERT_EQ(tagrid_reader_mesh(reader.get(), &options, &sink, nullptr), TAGRID_OK)
            << tagrid_reader_message(reader.get());
        EXPECT_EQ(taken.points, vtu.array<double>("Float64", "Points"));
        EXPECT_EQ(taken.values, vtu.array<std::int16_t>("Int16", "value"));
        EXPECT_EQ(taken.tetrahedra, vtu.array<std::int64_t>("Int64", "connectivity"));
        EXPECT_EQ(taken.levels, vtu.array<std::uint8_t>("UInt8", "level"));
      }
}

TEST_F(LibraryMesh, ABoxReadsTheBricksAroundItAndNothingElse) {
  const Index3 dims = {45, 45, 45};
  MemoryFile memory = encoded_file(dims, blobs<std::int16_t>(dims, 4), false, 1);
  const ReaderHandle reader = open_reader(memory);
  Taken taken;
  const tagrid_mesh_sink sink = taken.sink();
  // Within one brick of 8 samples an edge: with those below it on three axes they are 8.
  const tagrid_box box = {{18, 18, 18}, {22, 22, 22}};
  const tagrid_mesh_options options = mesh_options(&box);
  memory.reads.clear();
  ASSERT_EQ(tagrid_reader_mesh(reader.get(), &options, &sink, nullptr), TAGRID_OK);
  EXPECT_EQ(memory.reads.size(), 8u + 1) << "and the page of the index";
}

TEST_F(LibraryMesh, ASinkThatFailsEndsIt) {
  const Index3 dims = {19, 14, 17};
  MemoryFile memory = encoded_file(dims, blobs<std::int16_t>(dims, 5));
  const ReaderHandle reader = open_reader(memory);
  const tagrid_box box = {{1, 2, 3}, {18, 13, 16}};
  for (const tagrid_box* part : {static_cast<const tagrid_box*>(nullptr), &box}) {
    const tagrid_mesh_options options = mesh_options(part);
    Taken whole;
    tagrid_mesh_sink sink = whole.sink();
    ASSERT_EQ(tagrid_reader_mesh(reader.get(), &options, &sink, nullptr), TAGRID_OK);
    for (int n = 0; n < whole.calls; ++n) {
      Taken taken;
      taken.fails_at = n;
      sink = taken.sink();
      ASSERT_EQ(tagrid_reader_mesh(reader.get(), &options, &sink, nullptr), TAGRID_CANCELLED);
      EXPECT_EQ(taken.calls, n + 1);
    }
  }
}

TEST_F(LibraryMesh, AVolumeOfOneSliceHasAPaddedMeshOnly) {
  const Index3 dims = {9, 9, 1};
  MemoryFile memory = encoded_file(dims, blobs<std::int16_t>(dims, 6));
  const ReaderHandle reader = open_reader(memory);
  Taken taken;
  const tagrid_mesh_sink sink = taken.sink();
  tagrid_mesh_options options = mesh_options();
  EXPECT_EQ(tagrid_reader_mesh(reader.get(), &options, &sink, nullptr), TAGRID_INVALID_ARGUMENT);
  EXPECT_TRUE(has(std::string(tagrid_reader_message(reader.get())), "padded"));
  options.padded = 1;
  EXPECT_EQ(tagrid_reader_mesh(reader.get(), &options, &sink, nullptr), TAGRID_OK);
  EXPECT_FALSE(taken.levels.empty());
}

}  // namespace
}  // namespace tagrid
