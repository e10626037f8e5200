// Tetrahedra of the mesh, and the one at a place.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <map>
#include <numeric>
#include <set>

#include "stages/grid/conformity.h"
#include "stages/mesh/tetrahedra.h"
#include "tests/support/conforming_activity.h"
#include "tests/support/points.h"

namespace tagrid {
namespace {

using Point = std::array<std::int64_t, 3>;

Point point(Index3 p) { return {p.x, p.y, p.z}; }

std::vector<Tetrahedron> leaves(const LatticeBits& active, const Box& box, int cube_size, int level = 24) {
  std::vector<Tetrahedron> result;
  for_each_leaf_tetrahedron(active, box, cube_size, level,
                            [&](const Tetrahedron& t) { result.push_back(t); });
  return result;
}

std::set<std::array<Point, 4>> as_set(const std::vector<Tetrahedron>& mesh) {
  std::set<std::array<Point, 4>> set;
  for (const Tetrahedron& t : mesh) {
    std::array<Point, 4> key;
    for (std::size_t i = 0; i < 4; ++i) key[i] = point(t.vertices[i]);
    std::sort(key.begin(), key.end());
    set.insert(key);
  }
  return set;
}

struct RandomGrid {
  int cube_size;
  Box box;
  LatticeBits active;
};

RandomGrid random_grid() {
  RandomGrid g;
  g.cube_size = *rc::gen::element(4, 8, 16);
  const int most = g.cube_size == 16 ? 2 : 3;
  const auto cubes = [&] { return std::int64_t{*rc::gen::inRange(1, most + 1)} * g.cube_size; };
  const Index3 low = std::int64_t{*rc::gen::inRange(0, 3)} * g.cube_size * Index3{1, 0, 2};
  g.box = {low, low + Index3{cubes(), cubes(), cubes()}};
  g.active = random_conforming_activity(g.box, g.cube_size, *rc::gen::element(0, 1, 5, 40, 1000),
                                        *rc::gen::arbitrary<std::uint64_t>());
  return g;
}

RC_GTEST_PROP(LeafTetrahedra, VolumesArePositiveAndSumToTheBox, ()) {
  const RandomGrid g = random_grid();
  const std::int64_t root = std::int64_t{g.cube_size} * g.cube_size * g.cube_size;
  std::int64_t sum = 0;
  for (const Tetrahedron& t : leaves(g.active, g.box, g.cube_size)) {
    RC_ASSERT(six_volumes(t.vertices) > 0);
    RC_ASSERT((six_volumes(t.vertices) << t.level) == root);
    sum += six_volumes(t.vertices);
  }
  const Index3 d = g.box.high - g.box.low;
  RC_ASSERT(sum == 6 * d.x * d.y * d.z);
}

RC_GTEST_PROP(LeafTetrahedra, EveryInnerFaceIsSharedByExactlyTwo, ()) {
  const RandomGrid g = random_grid();
  RC_ASSERT(is_conforming(g.active, g.box, g.cube_size));
  std::map<std::array<Point, 3>, int> faces;
  for (const Tetrahedron& t : leaves(g.active, g.box, g.cube_size))
    for (std::size_t left_out = 0; left_out < 4; ++left_out) {
      std::array<Point, 3> face;
      for (std::size_t i = 0; i < 3; ++i) face[i] = point(t.vertices[i < left_out ? i : i + 1]);
      std::sort(face.begin(), face.end());
      ++faces[face];
    }
  for (const auto& [face, count] : faces) {
    bool on_surface = false;
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::int64_t plane : {g.box.low[static_cast<int>(axis)], g.box.high[static_cast<int>(axis)]})
        on_surface |= face[0][axis] == plane && face[1][axis] == plane && face[2][axis] == plane;
    RC_ASSERT(count == (on_surface ? 1 : 2));
  }
}

RC_GTEST_PROP(LeafTetrahedra, VerticesAreTheActivePointsAndNoneHangsInAnEdge, ()) {
  const RandomGrid g = random_grid();
  LatticeBits vertices(g.box);
  const auto mesh = leaves(g.active, g.box, g.cube_size);
  for (const Tetrahedron& t : mesh)
    for (Index3 v : t.vertices) vertices.set(v);
  RC_ASSERT(vertices == g.active);
  for (const Tetrahedron& t : mesh)
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = 0; j < i; ++j) {
        const Index3 d = t.vertices[i] - t.vertices[j];
        const std::int64_t steps = std::gcd(std::gcd(d.x, d.y), d.z);
        for (std::int64_t k = 1; k < steps; ++k) {
          const Index3 inner = t.vertices[j] + k * Index3{d.x / steps, d.y / steps, d.z / steps};
          RC_ASSERT(!vertices.test(inner));
        }
      }
}

RC_GTEST_PROP(LeafTetrahedra, RootCubesDoneAloneGiveTheSameMesh, ()) {
  const RandomGrid g = random_grid();
  const std::int64_t s = g.cube_size;
  std::set<std::array<Point, 4>> apart;
  std::size_t count = 0;
  for (const auto [x, y, z] : points_of(Box{g.box.low, g.box.high - Index3{1, 1, 1}}, s)) {
    const Box cube{{x, y, z}, {x + s, y + s, z + s}};
    LatticeBits own(cube);
    copy_bits(g.active, own);
    const auto mesh = leaves(own, cube, g.cube_size);
    count += mesh.size();
    apart.merge(as_set(mesh));
  }
  const auto together = leaves(g.active, g.box, g.cube_size);
  RC_ASSERT(count == together.size());
  RC_ASSERT(apart == as_set(together));
}

RC_GTEST_PROP(LeafTetrahedra, ThePrefixIsTheMeshWithoutFinerPoints, ()) {
  const RandomGrid g = random_grid();
  const int level = *rc::gen::inRange(0, max_level(g.cube_size) + 1);
  LatticeBits coarse(g.box);
  for_each_point(g.box, [&](Index3 p) {
    if (g.active.test(p) && classify(p, g.cube_size).level <= level) coarse.set(p);
  });
  const auto prefix = leaves(g.active, g.box, g.cube_size, level);
  for (const Tetrahedron& t : prefix) RC_ASSERT(t.level <= level);
  RC_ASSERT(as_set(prefix) == as_set(leaves(coarse, g.box, g.cube_size)));
}

// Bits from a damaged file make cracks, never anything worse.
RC_GTEST_PROP(LeafTetrahedra, AnyBitsStillFillTheBox, ()) {
  const Box box{{0, 0, 0}, {16, 8, 8}};
  LatticeBits bits(box);
  std::mt19937_64 random(*rc::gen::arbitrary<std::uint64_t>());
  for_each_point(box, [&](Index3 p) {
    if (random() & 1) bits.set(p);
  });
  std::int64_t sum = 0;
  for (const Tetrahedron& t : leaves(bits, box, 8)) sum += six_volumes(t.vertices);
  RC_ASSERT(sum == 6 * 16 * 8 * 8);
}

TEST(LeafTetrahedra, RootCubeHasSixAndTheFullGridSixTimesEightToTheK) {
  const Box box{{0, 0, 0}, {8, 8, 8}};
  LatticeBits bits(box);
  EXPECT_EQ(leaves(bits, box, 8).size(), 6u);
  for_each_point(box, [&](Index3 p) { bits.set(p); });
  for (int level = 0; level <= 9; ++level) EXPECT_EQ(leaves(bits, box, 8, level).size(), 6u << level);
}
// Volumes of the four tetrahedra that a place makes with the faces of a tetrahedron, in parts.
bool contains(const Tetrahedron& t, const Place& place, bool border) {
  std::array<Index3, 4> scaled;
  for (std::size_t i = 0; i < 4; ++i) scaled[i] = place.parts * t.vertices[i];
  for (std::size_t i = 0; i < 4; ++i) {
    std::array<Index3, 4> part = scaled;
    part[i] = place.numerators;
    const std::int64_t volume = six_volumes(part);
    if (volume < 0 || (volume == 0 && !border)) return false;
  }
  return true;
}

struct Grid {
  int cube_size;
  LatticeBits active;

  Place any_place() const {
    const std::int64_t parts = *rc::gen::element(1, 2, 16, 256);
    Place place{{}, parts};
    for (int axis = 0; axis < 3; ++axis)
      place.numerators[axis] =
          *rc::gen::inRange(parts * active.box().low[axis], parts * active.box().high[axis] + 1);
    return place;
  }
};

Grid any_grid() {
  const int cube_size = *rc::gen::element(4, 8, 16);
  const auto cubes = [&] { return std::int64_t{*rc::gen::inRange(1, 3)} * cube_size; };
  const Index3 low = std::int64_t{*rc::gen::inRange(0, 3)} * cube_size * Index3{1, 0, 2};
  const Box box{low, low + Index3{cubes(), cubes(), cubes()}};
  return {cube_size, random_conforming_activity(box, cube_size, *rc::gen::element(0, 1, 5, 40, 1000),
                                                *rc::gen::arbitrary<std::uint64_t>())};
}

RC_GTEST_PROP(LeafAt, IsTheLeafOfTheMeshThatContainsThePlace, ()) {
  const Grid grid = any_grid();
  std::vector<Tetrahedron> leaves;
  for_each_leaf_tetrahedron(grid.active, grid.active.box(), grid.cube_size, max_level(grid.cube_size),
                            [&](const Tetrahedron& t) { leaves.push_back(t); });
  for (int i = 0; i < 20; ++i) {
    const Place place = grid.any_place();
    const Tetrahedron found = leaf_at(grid.active, place, grid.cube_size).oriented();
    RC_ASSERT(contains(found, place, true));
    bool is_leaf = false;
    for (const Tetrahedron& leaf : leaves) {
      is_leaf = is_leaf || leaf.vertices == found.vertices;
      // Where the place is on no border, there is only one.
      if (contains(leaf, place, false)) {
        RC_ASSERT(leaf.vertices == found.vertices);
        RC_ASSERT(leaf.level == found.level);
      }
    }
    RC_ASSERT(is_leaf);
  }
}

TEST(LeafAt, IsExactFarFromTheOrigin) {
  constexpr int cube_size = 256;
  const Index3 low = (std::int64_t{1} << 29) * Index3{1, 2, 3};
  LatticeBits active(Box{low, low + cube_size * Index3{1, 1, 1}});
  for (std::uint64_t& word : active.words()) word = ~std::uint64_t{0};
  const Place place{1024 * low + Index3{70'001, 190'003, 12'345}, 1024};
  const BisectionStep leaf = leaf_at(active, place, cube_size);
  EXPECT_EQ(leaf.level, max_level(cube_size));
  EXPECT_TRUE(contains(leaf.oriented(), place, true));
}

}  // namespace
}  // namespace tagrid
