#include "stages/mesh/leaf_at.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <vector>

#include "tests/support/conforming_activity.h"

namespace tagrid {
namespace {

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
