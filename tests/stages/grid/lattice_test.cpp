// The lattice and its bits.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <string>

#include "stages/grid/lattice.h"
#include "stages/grid/lattice_bits.h"
#include "tests/support/conforming_activity.h"
#include "tests/support/points.h"

namespace tagrid {
namespace {

// Laws of the bisection hierarchy, for all points of small lattices of several root cubes.

struct Lattice {
  int cube_size;
  Index3 cubes;
  Box domain() const { return {{0, 0, 0}, cube_size * cubes}; }
};

class LatticeLaw : public testing::TestWithParam<Lattice> {
 protected:
  int cube_size() const { return GetParam().cube_size; }

  /// Calls f(p, class) for every point; stops at the first point that fails, and names it.
  template <class F>
  void for_all_points(F f) const {
    const Box box = GetParam().domain();
    for (const auto [x, y, z] : points_of(Box{{}, box.high})) {
      f(Index3{x, y, z}, classify({x, y, z}, cube_size()));
      if (testing::Test::HasFailure()) {
        ADD_FAILURE() << "at " << x << ' ' << y << ' ' << z;
        return;
      }
    }
  }

  template <class F>
  void for_all_but_root_corners(F f) const {
    for_all_points([&](Index3 p, const PointClass& c) {
      if (c.odd > 0) f(p, c);
    });
  }
};

bool has(const PointList& list, Index3 p) { return std::find(list.begin(), list.end(), p) != list.end(); }

bool is_multiple(Index3 p, std::int64_t n) { return p.x % n == 0 && p.y % n == 0 && p.z % n == 0; }

TEST_P(LatticeLaw, RootCornersAreTheMultiplesOfTheCubeSize) {
  for_all_points([&](Index3 p, const PointClass& c) {
    ASSERT_EQ(c.odd == 0, is_multiple(p, cube_size()));
    ASSERT_EQ(c.level == 0, c.odd == 0);
  });
}

TEST_P(LatticeLaw, UnitIsTheLargestThatDividesAllCoordinates) {
  for_all_but_root_corners([&](Index3 p, const PointClass& c) {
    ASSERT_LE(2 * c.unit, cube_size());
    ASSERT_TRUE(is_multiple(p, c.unit));
    ASSERT_FALSE(is_multiple(p, 2 * c.unit));
    int odd = 0;
    for (int axis = 0; axis < 3; ++axis) {
      ASSERT_EQ(c.is_odd[static_cast<std::size_t>(axis)], p[axis] / c.unit % 2 == 1);
      odd += static_cast<int>(p[axis] / c.unit % 2);
    }
    ASSERT_EQ(c.odd, odd);
  });
}

TEST_P(LatticeLaw, EveryPointHalvesItsBaseEdge) {
  for_all_but_root_corners([&](Index3 p, const PointClass& c) {
    const BaseEdge e = base_edge(p, c, cube_size());
    ASSERT_EQ(e.left + e.right, 2 * p);
    const Index3 d = e.right - e.left;
    ASSERT_EQ(d.x * d.x + d.y * d.y + d.z * d.z, c.odd * 4 * c.unit * c.unit);
  });
}

TEST_P(LatticeLaw, EndsOfTheBaseEdgeAreCornersOfCellsInTheDomain) {
  for_all_but_root_corners([&](Index3 p, const PointClass& c) {
    const BaseEdge e = base_edge(p, c, cube_size());
    ASSERT_TRUE(is_multiple(e.left, 2 * c.unit) && is_multiple(e.right, 2 * c.unit));
    ASSERT_TRUE(GetParam().domain().contains(e.left) && GetParam().domain().contains(e.right));
    ASSERT_LT(classify(e.left, cube_size()).level, c.level);
    ASSERT_LT(classify(e.right, cube_size()).level, c.level);
  });
}

TEST_P(LatticeLaw, DiagonalsJoinAnEvenWithAnOddCorner) {
  for_all_but_root_corners([&](Index3 p, const PointClass& c) {
    const BaseEdge e = base_edge(p, c, cube_size());
    std::vector<std::int64_t> left, right;
    for (int axis = 0; axis < 3; ++axis) {
      if (!c.is_odd[static_cast<std::size_t>(axis)]) continue;
      left.push_back(e.left[axis] / (2 * c.unit));
      right.push_back(e.right[axis] / (2 * c.unit));
    }
    for (std::size_t i = 0; i < left.size(); ++i) {
      if (2 * c.unit == cube_size()) {
        // Pattern A at the root: from the low corner to the high one.
        ASSERT_EQ(right[i], left[i] + 1);
      } else {
        ASSERT_EQ(left[i] % 2, left[0] % 2);
        ASSERT_NE(left[i] % 2, right[i] % 2);
      }
    }
  });
}

TEST_P(LatticeLaw, LevelsHoldTheExactNumberOfPoints) {
  std::vector<std::int64_t> counts(static_cast<std::size_t>(max_level(cube_size())) + 1);
  for_all_points([&](Index3, const PointClass& c) {
    ASSERT_GE(c.level, 0);
    ASSERT_LE(c.level, max_level(cube_size()));
    ++counts[static_cast<std::size_t>(c.level)];
  });
  const Index3 n = GetParam().cubes;
  EXPECT_EQ(counts[0], (n.x + 1) * (n.y + 1) * (n.z + 1));
  for (std::size_t cycle = 0; 3 * cycle + 3 < counts.size(); ++cycle) {
    const std::int64_t f = std::int64_t{1} << cycle, x = n.x * f, y = n.y * f, z = n.z * f;
    EXPECT_EQ(counts[3 * cycle + 1], x * y * z);
    EXPECT_EQ(counts[3 * cycle + 2], (x + 1) * y * z + x * (y + 1) * z + x * y * (z + 1));
    EXPECT_EQ(counts[3 * cycle + 3], x * (y + 1) * (z + 1) + (x + 1) * y * (z + 1) + (x + 1) * (y + 1) * z);
  }
}

TEST_P(LatticeLaw, NumbersOfParentsAndChildren) {
  for_all_but_root_corners([&](Index3 p, const PointClass& c) {
    const int parents_of[] = {0, 4, 2, c.level == 1 ? 0 : 3};
    const int children_of[] = {0, c.unit == 1 ? 0 : 8, 4, 6};
    ASSERT_EQ(parents(p, c, cube_size()).size, parents_of[c.odd]);
    ASSERT_EQ(children(p, c).size, children_of[c.odd]);
  });
}

TEST_P(LatticeLaw, ParentsAreOneLevelUpAndHaveThePointAsChild) {
  for_all_but_root_corners([&](Index3 p, const PointClass& c) {
    for (Index3 parent : parents(p, c, cube_size())) {
      const PointClass pc = classify(parent, cube_size());
      ASSERT_EQ(pc.level, c.level - 1);
      ASSERT_TRUE(has(children(parent, pc), p));
    }
  });
}

TEST_P(LatticeLaw, ChildrenAreOneLevelDownAndHaveThePointAsParent) {
  for_all_but_root_corners([&](Index3 p, const PointClass& c) {
    for (Index3 child : children(p, c)) {
      const PointClass cc = classify(child, cube_size());
      ASSERT_EQ(cc.level, c.level + 1);
      ASSERT_TRUE(has(parents(child, cc, cube_size()), p));
    }
  });
}

TEST_P(LatticeLaw, RelativesAreDifferentPoints) {
  for_all_but_root_corners([&](Index3 p, const PointClass& c) {
    for (PointList list : {parents(p, c, cube_size()), children(p, c)})
      for (int i = 0; i < list.size; ++i)
        for (int j = 0; j < i; ++j) ASSERT_NE(list[i], list[j]);
  });
}

TEST_P(LatticeLaw, OppositeFacesOfRootCubesAreCutByParallelDiagonals) {
  const std::int64_t s = cube_size();
  for_all_but_root_corners([&](Index3 p, const PointClass& c) {
    if (c.level != 2) return;
    for (int normal = 0; normal < 3; ++normal) {
      if (c.is_odd[static_cast<std::size_t>(normal)]) continue;
      const Index3 opposite = p + s * unit_vector(normal);
      const BaseEdge here = base_edge(p, c, cube_size());
      const BaseEdge there = base_edge(opposite, classify(opposite, cube_size()), cube_size());
      ASSERT_EQ(there.left - here.left, s * unit_vector(normal));
      ASSERT_EQ(there.right - here.right, s * unit_vector(normal));
    }
  });
}

TEST_P(LatticeLaw, TheUnboundedLatticeIsPeriodic) {
  const Index3 shift = -2 * std::int64_t{cube_size()} * Index3{1, 2, 3};
  for_all_but_root_corners([&](Index3 p, const PointClass& c) {
    const Index3 q = p + shift;
    const PointClass qc = classify(q, cube_size());
    ASSERT_EQ(qc.level, c.level);
    ASSERT_EQ(qc.is_odd, c.is_odd);
    ASSERT_EQ(base_edge(q, qc, cube_size()).left, base_edge(p, c, cube_size()).left + shift);
    const PointList here = parents(p, c, cube_size()), there = parents(q, qc, cube_size());
    for (int i = 0; i < here.size; ++i) ASSERT_EQ(there[i], here[i] + shift);
  });
}

INSTANTIATE_TEST_SUITE_P(Sizes, LatticeLaw,
                         testing::Values(Lattice{4, {3, 3, 3}}, Lattice{8, {3, 3, 3}}, Lattice{16, {2, 2, 2}},
                                         Lattice{32, {2, 2, 2}}, Lattice{32, {1, 3, 2}}),
                         [](const auto& test) {
                           std::string name = "S";
                           name += std::to_string(test.param.cube_size);
                           name += "Cubes";
                           for (int axis = 0; axis < 3; ++axis)
                             name += std::to_string(test.param.cubes[axis]);
                           return name;
                         });

TEST(Lattice, MaxLevelIsThreePerHalving) {
  EXPECT_EQ(max_level(4), 6);
  EXPECT_EQ(max_level(32), 15);
  EXPECT_EQ(max_level(256), 24);
}
Box random_box() {
  const auto coordinate = [] { return std::int64_t{*rc::gen::inRange(-5, 6)}; };
  const Index3 low{std::int64_t{*rc::gen::inRange(-140, 141)}, coordinate(), coordinate()};
  const Index3 size{*rc::gen::inRange(1, 200), *rc::gen::inRange(1, 8), *rc::gen::inRange(1, 8)};
  return {low, low + size - Index3{1, 1, 1}};
}

LatticeBits random_bits(const Box& box, std::uint64_t seed) {
  LatticeBits bits(box);
  std::mt19937_64 random(seed);
  for_each_point(box, [&](Index3 p) {
    if (random() & 1) bits.set(p);
  });
  return bits;
}

RC_GTEST_PROP(LatticeBits, EverySetPointIsVisitedOnceInRasterOrder, ()) {
  const Box box = random_box();
  LatticeBits bits = random_bits(box, 3);
  std::vector<std::int64_t> expected, visited;
  for_each_point(box, [&](Index3 p) {
    if (bits.test(p)) expected.push_back(box.offset(p));
  });
  for_each_set(bits, [&](Index3 p, std::size_t number) {
    RC_ASSERT(box.offset(p) == static_cast<std::int64_t>(number));
    visited.push_back(box.offset(p));
    bits.clear(p);
  });
  RC_ASSERT(visited == expected);
  RC_ASSERT(bits == LatticeBits(box));
}

RC_GTEST_PROP(LatticeBits, CopyTakesTheSharedPointsAndLeavesTheOthers, ()) {
  const LatticeBits from = random_bits(random_box(), 1);
  const LatticeBits before = random_bits(random_box(), 2);
  LatticeBits to = before;
  copy_bits(from, to);
  LatticeBits expected(to.box());
  for_each_point(to.box(), [&](Index3 p) {
    if (from.box().contains(p) ? from.test(p) : before.test(p)) expected.set(p);
  });
  RC_ASSERT(to == expected);  // compares the words, so bits past the end of rows must be zero
}

TEST(LatticeBits, EveryPointHasABitOfItsOwn) {
  const Box box{{-3, 2, 0}, {126, 4, 1}};
  for (Index3 only : {Index3{-3, 2, 0}, Index3{60, 2, 0}, Index3{61, 3, 1}, Index3{126, 4, 1}}) {
    LatticeBits bits(box);
    bits.set(only);
    for_each_point(box, [&](Index3 p) { EXPECT_EQ(bits.test(p), p == only); });
  }
}

TEST(LatticeBits, RowsStartWords) {
  LatticeBits bits(Box{{5, 0, 0}, {69, 1, 1}});
  EXPECT_EQ(bits.words_per_row(), 2u);
  EXPECT_EQ(bits.bytes(), 2u * 4 * 8);
  bits.set({69, 1, 1});
  EXPECT_EQ(bits.row(1, 1)[1], 1u);
  EXPECT_EQ(LatticeBits().bytes(), 0u);
}

}  // namespace
}  // namespace tagrid
