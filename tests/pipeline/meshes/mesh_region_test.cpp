// A region of the mesh: the tetrahedra of the whole mesh that meet it, from the bricks around it.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>

#include "io/errors/errors.h"
#include "io/tag/bricks.h"
#include "stages/mesh/cut.h"
#include "tests/support/meshed_volume.h"
#include "tests/support/points.h"

namespace tagrid {
namespace {

/// Tetrahedra as the places and values of their vertices, and their levels, sorted.
using SortedMesh = std::vector<std::pair<std::array<std::array<std::int64_t, 4>, 4>, int>>;

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

class MeshRegion : public MeshedVolume {
 protected:
  static WantedRegion region(const Box& box) {
    WantedRegion wanted;
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      wanted.low[a] = box.low[axis];
      wanted.high[a] = box.high[axis] + 1;
    }
    return wanted;
  }

  ValuedMesh read(const std::string& name) const {
    Vtu vtu(path(name));
    // Padding begins one step before the first sample.
    const Index3 first{1, 1, 1};
    ValuedMesh m{read_lattice_mesh(vtu, first), vtu.array<std::int16_t>("Int16", "value")};
    for (Index3& p : m.points) p = p - first;
    std::set<std::array<std::int64_t, 3>> points;
    for (const Index3& p : m.points)
      EXPECT_TRUE(points.insert({p.x, p.y, p.z}).second) << "a point is there twice";
    return m;
  }

  static SortedMesh those_that_meet(const ValuedMesh& mesh, const Box& box) {
    SortedMesh sorted;
    for (std::size_t t = 0; t < mesh.size(); ++t) {
      if (!meets(mesh.vertices(t), box)) continue;
      std::array<std::array<std::int64_t, 4>, 4> vertices;
      for (std::size_t v = 0; v < 4; ++v) {
        const auto i = static_cast<std::size_t>(mesh.connectivity[4 * t + v]);
        vertices[v] = {mesh.points[i].x, mesh.points[i].y, mesh.points[i].z, mesh.values[i]};
      }
      sorted.emplace_back(vertices, mesh.levels[t]);
    }
    std::sort(sorted.begin(), sorted.end());
    return sorted;
  }

  std::vector<Box> boxes(Index3 dims) {
    std::vector<Box> some = {Box::of_size(dims),
                             {{8, 8, 8}, {8, 8, 8}},  // a corner of bricks
                             {dims - Index3{1, 1, 1}, dims - Index3{1, 1, 1}},
                             {{0, 3, 0}, {dims.x - 1, 3, dims.z - 1}}};
    for (int i = 0; i < 4; ++i) {
      Box box;
      for (int axis = 0; axis < 3; ++axis) {
        const auto n = static_cast<std::uint64_t>(dims[axis]);
        const auto a = static_cast<std::int64_t>(random_() % n), b = static_cast<std::int64_t>(random_() % n);
        box.low[axis] = std::min(a, b);
        box.high[axis] = std::max(a, b);
      }
      some.push_back(box);
    }
    return some;
  }

  void check(const EncodeOptions& options) {
    const Index3 dims{21, 18, 19};
    encode(spiky_volume(dims, 5), options);
    int i = 0;
    for (const std::optional<int> level : {std::optional<int>(), std::optional(4)})
      for (const bool padded : {false, true}) {
        write_mesh(path("v.tag"), path("all.vtu"), {level, padded, true}, Resources(2));
        const ValuedMesh all = read("all.vtu");
        for (const Box& box : boxes(dims)) {
          const MeshResult result =
              write_mesh(path("v.tag"), path("part.vtu"), {level, padded, true, {}, region(box)},
                         Resources(1 + i++ % 3));
          const ValuedMesh part = read("part.vtu");
          EXPECT_EQ(result.tetrahedra, static_cast<std::int64_t>(part.size()));
          const std::set<std::int64_t> used(part.connectivity.begin(), part.connectivity.end());
          EXPECT_EQ(used.size(), part.points.size()) << "every point is one of a tetrahedron";
          const SortedMesh expected = those_that_meet(all, box);
          EXPECT_FALSE(expected.empty());
          // The faces of cut pieces have other directions.
          for (std::size_t t = 0; t < all.size(); ++t) {
            const bool met = meets(all.vertices(t), box);
            ASSERT_TRUE(met == meets_in_a_sample(all.vertices(t), box) || (met && !padded));
          }
          EXPECT_EQ(those_that_meet(part, Box{{-100, -100, -100}, {200, 200, 200}}), expected);
        }
      }
  }

  std::mt19937_64 random_{7};
};

const EncodeOptions small_bricks{.cube_size = 8, .brick_edge = 1};

TEST_F(MeshRegion, HasTheTetrahedraOfTheWholeMeshThatMeetIt) {
  check(small_bricks);
  check({.grid_only = true, .cube_size = 8, .brick_edge = 1});
  check({.grid = GridOrigin::derived, .cube_size = 8, .brick_edge = 1});
}

TEST_F(MeshRegion, NeedsOnlyTheBricksAroundIt) {
  const Index3 dims{40, 16, 16};
  encode(spiky_volume(dims, 5), small_bricks);
  const WantedRegion far = region({{33, 2, 2}, {38, 5, 5}}), near = region({{1, 1, 1}, {3, 3, 3}});
  write_mesh(path("v.tag"), path("before.vtu"), {{}, false, true, {}, far}, Resources(2));
  // The first byte of the first brick.
  std::string bytes = content("v.tag");
  {
    const TagBricks file(std::make_shared<FileSource>(path("v.tag")));
    bytes[bytes.find(std::string(reinterpret_cast<const char*>(file.read(0).values.data()), 16))] ^= 1;
  }
  file("v.tag", bytes);
  write_mesh(path("v.tag"), path("after.vtu"), {{}, false, true, {}, far}, Resources(2));
  EXPECT_EQ(content("after.vtu"), content("before.vtu"));
  EXPECT_THROW(write_mesh(path("v.tag"), path("x.vtu"), {{}, false, true, {}, near}, Resources(2)),
               BrokenInput);
}

TEST_F(MeshRegion, OutsideOfTheVolumeIsRefused) {
  const Index3 dims{21, 18, 19};
  encode(spiky_volume(dims, 5), small_bricks);
  const auto before = names();
  for (const Box& box : {Box{{0, 0, 0}, {21, 1, 1}}, Box{{-1, 0, 0}, {1, 1, 1}}, Box{{3, 3, 3}, {3, 2, 3}},
                         Box{{30, 30, 30}, {31, 31, 31}}})
    for (const bool padded : {false, true})
      EXPECT_THROW(
          write_mesh(path("v.tag"), path("x.vtu"), {{}, padded, true, {}, region(box)}, Resources(1)),
          UsageError);
  EXPECT_EQ(names(), before);
}

}  // namespace
}  // namespace tagrid
