// The mesh through callbacks: the same as that of the program, and parts of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>

#include "stages/mesh/cut.h"
#include "tests/pipeline/library/library_calls.h"
#include "tests/support/awkward_volumes.h"
#include "tests/support/points.h"
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

  using Corner = std::array<double, 4>;  // with its value
  using Tet = std::pair<int, std::array<Corner, 4>>;
  Tet tetrahedron(std::size_t i) const {
    Tet t = {levels[i], {}};
    for (std::size_t v = 0; v < 4; ++v) {
      const auto p = static_cast<std::size_t>(tetrahedra[4 * i + v]);
      t.second[v] = {points[3 * p], points[3 * p + 1], points[3 * p + 2], static_cast<double>(values[p])};
    }
    return t;
  }
  std::array<Index3, 4> vertices(std::size_t i) const {
    std::array<Index3, 4> v;
    const Tet t = tetrahedron(i);
    for (std::size_t c = 0; c < 4; ++c)
      for (int axis = 0; axis < 3; ++axis)
        v[c][axis] = static_cast<std::int64_t>(t.second[c][static_cast<std::size_t>(axis)]);
    return v;
  }
};

struct LibraryMesh : TemporaryFolder {};

TEST_F(LibraryMesh, TheWholeMeshIsThatOfTheProgram) {
  const Index3 dims = {19, 14, 17};
  const auto samples = blobs<std::int16_t>(dims, 1);
  for (const bool grid_only : {false, true})
    for (const bool padded : {false, true})
      for (const int level : {-1, 2}) {
        MemoryFile memory = encoded_file(dims, samples, grid_only);
        file("volume.tag", memory.bytes);
        MeshOptions same;
        if (level >= 0) same.level = level;
        same.padded = padded;
        same.overwrite = true;
        write_mesh(path("volume.tag"), path("mesh.vtu"), same, Resources(2));
        Vtu vtu(path("mesh.vtu"));

        Taken taken;
        const tagrid_mesh_sink sink = taken.sink();
        tagrid_mesh_options options;
        tagrid_mesh_options_init(&options);
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

// A tetrahedron of the hierarchy and a box of samples meet in a polytope whose corners are samples.
bool meets_in_a_sample(const std::array<Index3, 4>& v, const Box& box) {
  for (const auto [x, y, z] : points_of(box)) {
    bool within = true;
    const bool positive = six_volumes(v) > 0;
    for (std::size_t i = 0; i < 4 && within; ++i) {
      auto other = v;
      other[i] = {x, y, z};
      within = positive ? six_volumes(other) >= 0 : six_volumes(other) <= 0;
    }
    if (within) return true;
  }
  return false;
}

TEST_F(LibraryMesh, ABoxHasTheTetrahedraOfTheWholeMeshThatMeetItAndEveryPointOnce) {
  const Index3 dims = {21, 18, 19};
  const auto samples = blobs<std::int16_t>(dims, 2);
  std::mt19937_64 random(3);
  for (const bool grid_only : {false, true})
    for (const bool padded : {false, true}) {
      MemoryFile memory = encoded_file(dims, samples, grid_only);
      const ReaderHandle reader = open_reader(memory);
      tagrid_mesh_options options;
      tagrid_mesh_options_init(&options);
      options.padded = padded;
      Taken all;
      tagrid_mesh_sink sink = all.sink();
      ASSERT_EQ(tagrid_reader_mesh(reader.get(), &options, &sink, nullptr), TAGRID_OK);
      for (int i = 0; i < 12; ++i) {
        tagrid_box box = any_box(dims, random);
        if (i == 0) box = {{0, 0, 0}, {dims.x, dims.y, dims.z}};
        if (i == 1) box = {{8, 8, 8}, {9, 9, 9}};  // a corner of eight bricks
        if (i == 2) box = {{dims.x - 1, 3, 3}, {dims.x, 4, 4}};
        options.box = &box;
        const Box closed = {{box.low[0], box.low[1], box.low[2]},
                            {box.high[0] - 1, box.high[1] - 1, box.high[2] - 1}};
        std::vector<Taken::Tet> expected, found;
        for (std::size_t t = 0; t < all.levels.size(); ++t) {
          const bool met = meets(all.vertices(t), closed);
          // The faces of cut pieces have other directions.
          const bool in_a_sample = meets_in_a_sample(all.vertices(t), closed);
          ASSERT_TRUE(met == in_a_sample || (met && !padded));
          if (met) expected.push_back(all.tetrahedron(t));
        }
        Taken part;
        sink = part.sink();
        const tagrid_call call = call_of(1 + i % 3);
        ASSERT_EQ(tagrid_reader_mesh(reader.get(), &options, &sink, &call), TAGRID_OK)
            << tagrid_reader_message(reader.get());
        for (std::size_t t = 0; t < part.levels.size(); ++t) found.push_back(part.tetrahedron(t));
        EXPECT_FALSE(found.empty());
        std::sort(expected.begin(), expected.end());
        std::sort(found.begin(), found.end());
        ASSERT_EQ(found, expected);
        std::set<std::array<double, 3>> points;
        for (std::size_t p = 0; p < part.values.size(); ++p)
          EXPECT_TRUE(
              points.insert({part.points[3 * p], part.points[3 * p + 1], part.points[3 * p + 2]}).second);
        std::set<std::int64_t> used(part.tetrahedra.begin(), part.tetrahedra.end());
        EXPECT_EQ(used.size(), part.values.size());
        if (i == 0) {
          EXPECT_EQ(part.points, all.points);
          EXPECT_EQ(part.tetrahedra, all.tetrahedra);
        }
        options.box = nullptr;
      }
    }
}

TEST_F(LibraryMesh, ABoxReadsTheBricksAroundItAndNothingElse) {
  const Index3 dims = {45, 45, 45};
  const auto samples = blobs<std::int16_t>(dims, 4);
  MemoryFile memory = encoded_file(dims, samples, false, 1);
  const ReaderHandle reader = open_reader(memory);
  Taken taken;
  const tagrid_mesh_sink sink = taken.sink();
  tagrid_mesh_options options;
  tagrid_mesh_options_init(&options);
  // Within one brick of 8 samples an edge: with those below it on three axes they are 8.
  const tagrid_box box = {{18, 18, 18}, {22, 22, 22}};
  options.box = &box;
  memory.reads.clear();
  ASSERT_EQ(tagrid_reader_mesh(reader.get(), &options, &sink, nullptr), TAGRID_OK);
  EXPECT_EQ(memory.reads.size(), 8u + 1) << "and the page of the index";
}

TEST_F(LibraryMesh, ASinkThatFailsEndsIt) {
  const Index3 dims = {19, 14, 17};
  MemoryFile memory = encoded_file(dims, blobs<std::int16_t>(dims, 5));
  const ReaderHandle reader = open_reader(memory);
  tagrid_mesh_options options;
  tagrid_mesh_options_init(&options);
  const tagrid_box box = {{1, 2, 3}, {18, 13, 16}};
  for (const tagrid_box* part : {static_cast<const tagrid_box*>(nullptr), &box}) {
    options.box = part;
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
  tagrid_mesh_options options;
  tagrid_mesh_options_init(&options);
  EXPECT_EQ(tagrid_reader_mesh(reader.get(), &options, &sink, nullptr), TAGRID_INVALID_ARGUMENT);
  EXPECT_TRUE(has(std::string(tagrid_reader_message(reader.get())), "padded"));
  options.padded = 1;
  EXPECT_EQ(tagrid_reader_mesh(reader.get(), &options, &sink, nullptr), TAGRID_OK);
  EXPECT_FALSE(taken.levels.empty());
}

}  // namespace
}  // namespace tagrid
