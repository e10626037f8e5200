// Root cubes cover the volume, bricks cover the root cubes, every sample has one owner.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <set>

#include "stages/grid/brick_grid.h"
#include "stages/grid/lattice.h"
#include "stages/sample/coding_parameters.h"
#include "tests/support/conforming_activity.h"
#include "tests/support/points.h"

namespace tagrid {
namespace {

Index3 random_dims(int longest) {
  const auto length = [&] { return std::int64_t{*rc::gen::inRange(1, longest + 1)}; };
  return {length(), length(), length()};
}

RC_GTEST_PROP(Domain, IsTheSmallestOfWholeRootCubesThatHoldsEverySample, ()) {
  const int s = *rc::gen::element(4, 8, 16, 32, 64, 128, 256);
  const Domain domain{random_dims(700), s, *rc::gen::inRange(0, 2)};
  RC_ASSERT(domain.padded().contains(domain.volume()));
  RC_ASSERT(domain.padded().low == (Index3{0, 0, 0}));
  for (int axis = 0; axis < 3; ++axis) {
    RC_ASSERT(domain.padded().high[axis] % s == 0);
    RC_ASSERT(domain.padded().high[axis] == domain.cubes(axis) * s);
    RC_ASSERT(domain.cubes(axis) >= 1);
    // One cube less would not be enough.
    RC_ASSERT(domain.cubes(axis) == 1 || (domain.cubes(axis) - 1) * s < domain.volume().high[axis]);
  }
}

TEST(VolumeSize, HasLimitsOfEachAxisAndOfAll) {
  constexpr std::int64_t largest = std::int64_t{1} << 31;
  EXPECT_TRUE(is_volume_size({1, 1, 1}));
  EXPECT_TRUE(is_volume_size({largest, largest / 16, 1}));
  EXPECT_TRUE(is_volume_size({1 << 20, 1 << 19, 1 << 19}));
  EXPECT_FALSE(is_volume_size({1 << 20, 1 << 19, (1 << 19) + 1}));
  EXPECT_FALSE(is_volume_size({largest, largest / 16 + 1, 1}));
  for (int axis = 0; axis < 3; ++axis)
    for (const std::int64_t size : {std::int64_t{-1}, std::int64_t{0}, largest + 1}) {
      Index3 dims{1, 1, 1};
      dims[axis] = size;
      EXPECT_FALSE(is_volume_size(dims)) << axis << ' ' << size;
    }
}

TEST(Domain, CountsCubesAtTheBorderOfASize) {
  const auto cubes = [](std::int64_t n) { return Domain{{n, 1, 1}, 32}.cubes(0); };
  EXPECT_EQ(cubes(1), 1);
  EXPECT_EQ(cubes(2), 1);
  EXPECT_EQ(cubes(32), 1);
  EXPECT_EQ(cubes(33), 1);
  EXPECT_EQ(cubes(34), 2);
  EXPECT_EQ(cubes(65), 2);
  EXPECT_EQ(cubes(66), 3);
}

TEST(Domain, BeginsOneStepBeforeTheFirstSampleIfItHasALead) {
  const Domain domain{{512, 2, 1}, 32, 1};
  EXPECT_EQ(domain.first(), (Index3{1, 1, 0})) << "the plane of an only slice stays a face of root cubes";
  EXPECT_EQ(domain.cubes(0), 16);
  EXPECT_EQ(domain.volume(), (Box{{1, 1, 0}, {512, 2, 0}}));
  EXPECT_EQ(domain.samples_at(domain.volume()), Box::of_size({512, 2, 1}));
  const auto cubes = [](std::int64_t n) { return Domain{{n, 1, 1}, 32, 1}.cubes(0); };
  EXPECT_EQ(cubes(1), 1);
  EXPECT_EQ(cubes(2), 1);
  EXPECT_EQ(cubes(32), 1);
  EXPECT_EQ(cubes(33), 2);
  EXPECT_EQ(cubes(64), 2);
  EXPECT_EQ(cubes(65), 3);
}

RC_GTEST_PROP(BrickGrid, WithALeadAnAlignedChunkIsABrick, ()) {
  const BrickGrid bricks{{random_dims(300), *rc::gen::element(4, 16, 32), 1}, *rc::gen::inRange(1, 4)};
  for (std::int64_t id = 0; id < bricks.count(); ++id) {
    const Index3 low = bricks.length() * bricks.position(id), edges = bricks.length() * Index3{1, 1, 1};
    RC_ASSERT(bricks.domain.samples_at(bricks.owned_box(bricks.position(id))) ==
              intersection({low, low + edges - Index3{1, 1, 1}}, Box::of_size(bricks.domain.dims)));
  }
}

RC_GTEST_PROP(PointsUpToLevel, EqualALiteralCount, ()) {
  const int s = *rc::gen::element(4, 8, 16);
  const Domain domain{random_dims(40), s, *rc::gen::inRange(0, 2)};
  std::vector<std::uint64_t> expected(static_cast<std::size_t>(max_level(s)) + 1);
  for_each_point(domain.padded(),
                 [&](Index3 p) { ++expected[static_cast<std::size_t>(classify(p, s).level)]; });
  for (std::size_t l = 1; l < expected.size(); ++l) expected[l] += expected[l - 1];
  RC_ASSERT(points_up_to_level(domain) == expected);
}

// The non-adaptive grids of the paper's tables.
TEST(PointsUpToLevel, AreThoseOfThePaper) {
  const auto lobster = points_up_to_level({{321, 321, 33}, 32});
  EXPECT_EQ(lobster[0], 242U);
  EXPECT_EQ(lobster[3], 1323U);
  EXPECT_EQ(lobster[6], 8405U);
  EXPECT_EQ(lobster[9], 59049U);
  EXPECT_EQ(lobster[12], 440657U);
  EXPECT_EQ(lobster[15], 3400353U);
  const auto foot = points_up_to_level({{161, 321, 129}, 32});
  EXPECT_EQ(foot[9], 109593U);
  EXPECT_EQ(foot[12], 847665U);
}

RC_GTEST_PROP(BrickGrid, EverySampleHasOneOwner, ()) {
  const BrickGrid bricks{{random_dims(40), *rc::gen::element(4, 8, 16), *rc::gen::inRange(0, 2)},
                         *rc::gen::inRange(1, 4)};
  const Box volume = bricks.domain.volume();
  std::vector<int> owners(static_cast<std::size_t>(volume.count()));
  for (std::int64_t id = 0; id < bricks.count(); ++id) {
    const Index3 position = bricks.position(id);
    RC_ASSERT(bricks.id(position) == id);
    const Box owned = bricks.owned_box(position), closed = bricks.closed_box(position);
    RC_ASSERT(!owned.empty());
    RC_ASSERT(closed.contains(owned));
    RC_ASSERT(volume.contains(owned));
    for_each_point(owned, [&](Index3 p) { ++owners[static_cast<std::size_t>(volume.offset(p))]; });
    // A point outside the volume repeats a sample of its own brick.
    for_each_point(closed, [&](Index3 p) {
      for (int axis = 0; axis < 3; ++axis)
        if (position[axis] > 0 && p[axis] == closed.low[axis]) return;
      RC_ASSERT(owned.contains(volume.nearest(p)));
    });
  }
  for (const int n : owners) RC_ASSERT(n == 1);
}

RC_GTEST_PROP(BrickGrid, ClosedBoxesMeetAtSharedFacesAndFillTheDomain, ()) {
  const BrickGrid bricks{{random_dims(200), *rc::gen::element(4, 16, 64), *rc::gen::inRange(0, 2)},
                         *rc::gen::inRange(1, 4)};
  const Box padded = bricks.domain.padded();
  for (std::int64_t id = 0; id < bricks.count(); ++id) {
    const Index3 position = bricks.position(id);
    const Box box = bricks.closed_box(position);
    for (int axis = 0; axis < 3; ++axis) {
      RC_ASSERT(box.high[axis] > box.low[axis]);
      RC_ASSERT(box.low[axis] % bricks.domain.cube_size == 0);
      if (position[axis] == 0) RC_ASSERT(box.low[axis] == 0);
      if (position[axis] + 1 == bricks.bricks(axis))
        RC_ASSERT(box.high[axis] == padded.high[axis]);
      else
        RC_ASSERT(bricks.closed_box(position + unit_vector(axis)).low[axis] == box.high[axis]);
    }
  }
}

// Diamonds against Eqs. 2-4 of the paper, against the three primitives, and against bisection itself.

using Key = std::array<std::array<std::int64_t, 3>, 4>;

Key key_of(const std::array<Index3, 4>& vertices) {
  Key key;
  for (std::size_t i = 0; i < 4; ++i) key[i] = {vertices[i].x, vertices[i].y, vertices[i].z};
  std::sort(key.begin(), key.end());
  return key;
}

template <class F>
void for_all_diamonds(int cube_size, Index3 cubes, F f) {
  const Box box{{0, 0, 0}, std::int64_t{cube_size} * cubes};
  for (const auto [x, y, z] : points_of(Box{{}, box.high})) {
    const Index3 p{x, y, z};
    const PointClass c = classify(p, cube_size);
    if (c.odd == 0) continue;
    f(p, c, diamond(p, c, cube_size));
    ASSERT_FALSE(testing::Test::HasFailure()) << "at " << x << ' ' << y << ' ' << z;
  }
}

// The two ends of the longest edge, or i == j when it is not unique.
std::pair<std::size_t, std::size_t> longest_edge(const std::array<Index3, 4>& v) {
  std::pair<std::size_t, std::size_t> best{0, 0};
  std::int64_t longest = 0;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = i + 1; j < 4; ++j) {
      const std::int64_t length = squared_length(v[j] - v[i]);
      if (length == longest) best = {0, 0};
      if (length > longest) best = {i, j};
      longest = std::max(longest, length);
    }
  return best;
}

// Bisects at the longest edge: geometry only, no lattice rule.
std::array<std::array<Index3, 4>, 2> bisect(const std::array<Index3, 4>& v) {
  const auto [i, j] = longest_edge(v);
  EXPECT_NE(i, j);
  const Index3 sum = v[i] + v[j], middle{sum.x / 2, sum.y / 2, sum.z / 2};
  EXPECT_EQ(2 * middle, sum);
  auto a = v, b = v;
  a[i] = middle;
  b[j] = middle;
  return {a, b};
}

TEST(Diamond, HasSixFourOrEightTetrahedra) {
  for_all_diamonds(8, {2, 2, 2}, [](Index3, const PointClass& c, const Diamond& d) {
    const int expected[] = {0, 8, 4, 6};
    ASSERT_EQ(d.size(), expected[c.odd]);
    ASSERT_EQ(d.level, c.level - 1);
  });
}

TEST(Diamond, VerticesAreThoseOfEquations2To4) {
  for_all_diamonds(8, {2, 2, 2}, [](Index3 p, const PointClass& c, const Diamond& d) {
    const std::int64_t length = 2 * c.unit;  // L of the paper
    const Index3 p1 = d.edge.left, p2 = d.edge.right;
    std::set<std::array<std::int64_t, 3>> expected, got;
    const auto expect = [&](Index3 q) { expected.insert({q.x, q.y, q.z}); };
    std::vector<int> odd_axes, even_axes;
    for (int axis = 0; axis < 3; ++axis)
      (c.is_odd[static_cast<std::size_t>(axis)] ? odd_axes : even_axes).push_back(axis);
    for (int axis : odd_axes) {
      if (c.odd == 1) break;
      const std::int64_t sign = p2[axis] > p1[axis] ? 1 : -1;
      expect(p1 + sign * length * unit_vector(axis));                  // Eqs. 2 and 3
      if (c.odd == 3) expect(p2 - sign * length * unit_vector(axis));  // Eq. 2
    }
    if (c.odd == 2)
      for (int sign : {-1, 1}) expect(p + sign * (length / 2) * unit_vector(even_axes[0]));  // Eq. 3
    if (c.odd == 1)
      for (int i = -1; i <= 1; ++i)
        for (int j = -1; j <= 1; ++j)
          if (i != 0 || j != 0)  // Eq. 4
            expect(p + length / 2 * (i * unit_vector(even_axes[0]) + j * unit_vector(even_axes[1])));
    for (Index3 q : d.ring) got.insert({q.x, q.y, q.z});
    ASSERT_EQ(got, expected);
    ASSERT_EQ(d.ring.size + 2, c.odd == 3 ? 8 : c.odd == 2 ? 6 : 10);
  });
}

TEST(Diamond, TetrahedraAreThePrimitiveOfTheirLevelAndHalveInVolume) {
  for (int cube_size : {4, 8, 16}) {
    const std::int64_t root_volume = std::int64_t{cube_size} * cube_size * cube_size;
    for_all_diamonds(cube_size, {2, 2, 2}, [&](Index3, const PointClass& c, const Diamond& d) {
      for (int i = 0; i < d.size(); ++i) {
        const Tetrahedron t = d.tetrahedron(i);
        // Root tetrahedra have a sixth of the cube each.
        ASSERT_EQ(six_volumes(t.vertices) << (c.level - 1), root_volume);
        std::vector<std::int64_t> lengths;
        for (std::size_t a = 0; a < 4; ++a)
          for (std::size_t b = 0; b < a; ++b)
            lengths.push_back(squared_length(t.vertices[a] - t.vertices[b]));
        std::sort(lengths.begin(), lengths.end());
        // Squared ratio of longest to shortest edge: 3, 8/3, 4 for TYPE-I, II, III.
        const std::int64_t numerator[] = {3, 8, 4}, denominator[] = {1, 3, 1};
        ASSERT_EQ(lengths[5] * denominator[t.type()], lengths[0] * numerator[t.type()]);
        // All six edges, in units that make the shortest of each primitive an integer.
        const std::int64_t u2 = c.unit * c.unit;
        const std::vector<std::vector<std::int64_t>> edges = {
            {4 * u2, 4 * u2, 4 * u2, 8 * u2, 8 * u2, 12 * u2},
            {3 * u2, 3 * u2, 3 * u2, 4 * u2, 4 * u2, 8 * u2},
            {u2, 2 * u2, 2 * u2, 3 * u2, 3 * u2, 4 * u2}};
        ASSERT_EQ(lengths, edges[static_cast<std::size_t>(t.type())]);
      }
    });
  }
}

TEST(Diamond, BaseEdgeIsTheLongestEdgeOfEachTetrahedron) {
  for_all_diamonds(8, {2, 2, 2}, [](Index3, const PointClass&, const Diamond& d) {
    for (int i = 0; i < d.size(); ++i)
      ASSERT_EQ(longest_edge(d.tetrahedron(i).vertices), (std::pair<std::size_t, std::size_t>{0, 1}));
  });
}

// With the root tetrahedra as the start, this makes diamonds and parents the hierarchy of bisection.
TEST(Diamond, TetrahedraAreHalvesOfTetrahedraOfTheParents) {
  for (int cube_size : {4, 8})
    for_all_diamonds(cube_size, {2, 2, 2}, [&](Index3 p, const PointClass& c, const Diamond& d) {
      if (c.level == 1) return;
      std::multiset<Key> halves;
      std::vector<std::set<Key>> of_parent;
      for (Index3 parent : parents(p, c, cube_size)) {
        const Diamond pd = diamond(parent, classify(parent, cube_size), cube_size);
        of_parent.emplace_back();
        for (int i = 0; i < pd.size(); ++i)
          for (const auto& half : bisect(pd.tetrahedron(i).vertices)) {
            halves.insert(key_of(half));
            of_parent.back().insert(key_of(half));
          }
      }
      for (int i = 0; i < d.size(); ++i)
        ASSERT_EQ(halves.count(key_of(d.tetrahedron(i).vertices)), 1u) << "tetrahedron " << i;
      for (const auto& set : of_parent) {
        bool needed = false;
        for (int i = 0; i < d.size(); ++i) needed |= set.contains(key_of(d.tetrahedron(i).vertices));
        ASSERT_TRUE(needed);
      }
    });
}

// The six tetrahedra around the diagonal of a cube of edge `s` that starts at corner `pattern`.
std::vector<std::array<Index3, 4>> root_tetrahedra(std::int64_t s, Index3 pattern) {
  const std::array<std::array<int, 3>, 6> paths = {
      {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};
  std::vector<std::array<Index3, 4>> roots;
  for (const auto& path : paths) {
    std::array<Index3, 4> v{s * pattern};
    for (std::size_t i = 0; i < 3; ++i)
      v[i + 1] = v[i] + (pattern[path[i]] == 0 ? s : -s) * unit_vector(path[i]);
    roots.push_back(v);
  }
  return roots;
}

std::set<Key> after_bisections(std::vector<std::array<Index3, 4>> mesh, int levels) {
  for (int level = 0; level < levels; ++level) {
    std::vector<std::array<Index3, 4>> finer;
    for (const auto& t : mesh)
      for (const auto& half : bisect(t)) finer.push_back(half);
    mesh = std::move(finer);
  }
  std::set<Key> keys;
  for (const auto& t : mesh) keys.insert(key_of(t));
  return keys;
}

TEST(RootPatterns, AllFourGiveTheSameMeshAfterOneCycle) {
  const std::array<Index3, 4> patterns = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  const std::set<Key> reference = after_bisections(root_tetrahedra(8, patterns[0]), 3);
  EXPECT_EQ(reference.size(), 48u);
  for (Index3 pattern : patterns) {
    EXPECT_EQ(after_bisections(root_tetrahedra(8, pattern), 3), reference);
    if (pattern != patterns[0]) {
      EXPECT_NE(after_bisections(root_tetrahedra(8, pattern), 2), reference);
      EXPECT_NE(after_bisections(root_tetrahedra(8, pattern), 0),
                after_bisections(root_tetrahedra(8, patterns[0]), 0));
    }
  }
}

TEST(RootPatterns, TheMeshAfterOneCycleIsThatOfTheDiamonds) {
  std::set<Key> of_diamonds;
  for_all_diamonds(8, {1, 1, 1}, [&](Index3, const PointClass& c, const Diamond& d) {
    for (int i = 0; c.level == 4 && i < d.size(); ++i) of_diamonds.insert(key_of(d.tetrahedron(i).vertices));
  });
  EXPECT_EQ(of_diamonds, after_bisections(root_tetrahedra(8, {0, 0, 0}), 3));
}

// Fig. 22: cells of the same pattern are diagonally positioned, and all meet at the centre.
TEST(RootPatterns, TheEightCellsOfACubePairUpDiagonally) {
  const int s = 8;
  for (int octant = 0; octant < 8; ++octant) {
    const Index3 at{octant & 1, octant >> 1 & 1, octant >> 2 & 1};
    const Index3 cell = Index3{2, 2, 2} + 4 * at, mirrored = Index3{8, 8, 8} - cell;
    const auto direction = [&](Index3 p) {
      const BaseEdge e = base_edge(p, classify(p, s), s);
      return e.right - e.left;
    };
    const Index3 d = direction(cell), opposite = direction(mirrored);
    EXPECT_TRUE(d == opposite || d == -1 * opposite);
    const BaseEdge e = base_edge(cell, classify(cell, s), s);
    EXPECT_TRUE(e.left == (Index3{4, 4, 4}) || e.right == (Index3{4, 4, 4}));
  }
}

}  // namespace
}  // namespace tagrid
