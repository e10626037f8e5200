// The closure, compared with the paper's own recursion, and brick by brick with the whole volume.
#include "stages/criterion/subdivide.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "stages/grid/conformity.h"
#include "stages/grid/lattice.h"
#include "tests/support/conforming_activity.h"
#include "tests/support/oracle.h"
#include "tests/support/points.h"

namespace tagrid {
namespace {

// All tetrahedra of a domain, of every level, found by bisecting the roots at their longest edges; and the
// paper's recursion on them.
class PaperRecursion {
 public:
  PaperRecursion(const Box& domain, int cube_size, const LatticeBits& marks, bool remembers)
      : domain_(domain), max_level_(max_level(cube_size)), marks_(marks), remembers_(remembers) {
    sharing_.resize(static_cast<std::size_t>(domain.count()));
    answers_.assign(sharing_.size(), unknown);
    for (const auto [x, y, z] : points_of(Box{domain.low, domain.high - Index3{1, 1, 1}}, cube_size))
      add_cube({x, y, z}, cube_size);
  }

  /// Whether the base edge with this midpoint is bisected.
  bool requires_subdivision(Index3 midpoint) {
    const auto& tetrahedra = sharing_[at(midpoint)];
    return !tetrahedra.empty() && neighbor_require_for_subdivision(tetrahedra.front());
  }

 private:
  enum Answer : char { unknown, no, yes };
  struct Longest {
    std::size_t left, right;
    Index3 midpoint;
  };

  std::size_t at(Index3 p) const { return static_cast<std::size_t>(domain_.offset(p)); }

  static Longest base_edge_of(const Tetrahedron& t) {
    Longest longest{0, 1, {}};
    std::int64_t most = 0;
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = i + 1; j < 4; ++j)
        if (const std::int64_t l = squared_length(t.vertices[j] - t.vertices[i]); l > most) {
          most = l;
          longest.left = i;
          longest.right = j;
        }
    const Index3 sum = t.vertices[longest.left] + t.vertices[longest.right];
    longest.midpoint = {sum.x / 2, sum.y / 2, sum.z / 2};
    return longest;
  }

  static std::array<Tetrahedron, 2> divide(const Tetrahedron& t) {
    const Longest e = base_edge_of(t);
    std::array<Tetrahedron, 2> halves{t, t};
    halves[0].vertices[e.right] = e.midpoint;
    halves[1].vertices[e.left] = e.midpoint;
    ++halves[0].level;
    ++halves[1].level;
    return halves;
  }

  // The six paths along the axes from the low corner to the high one.
  void add_cube(Index3 corner, std::int64_t size) {
    for (int first = 0; first < 3; ++first)
      for (int second = 0; second < 3; ++second)
        if (first != second) {
          const Index3 a = corner + size * unit_vector(first), b = a + size * unit_vector(second);
          add({{corner, a, b, corner + size * Index3{1, 1, 1}}, 0});
        }
  }
  void add(const Tetrahedron& t) {
    if (t.level == max_level_) return;
    sharing_[at(base_edge_of(t).midpoint)].push_back(t);
    for (const Tetrahedron& half : divide(t)) add(half);
  }

  bool neighbor_require_for_subdivision(const Tetrahedron& t) {
    // Step 1, first half: the smallest tetrahedra have no base edge to test.
    if (t.level == max_level_) return false;
    const Index3 midpoint = base_edge_of(t).midpoint;
    Answer& answer = answers_[at(midpoint)];
    if (remembers_ && answer != unknown) return answer == yes;
    // Step 0: the accuracy along the base edge does not reach the threshold.
    bool required = marks_.test(midpoint);
    // Steps 2 and 3: every tetrahedron that shares the base edge, both halves.
    for (const Tetrahedron& neighbour : sharing_[at(midpoint)])
      for (const Tetrahedron& half : divide(neighbour))
        required = required || neighbor_require_for_subdivision(half);
    answer = required ? yes : no;
    return required;
  }

  Box domain_;
  int max_level_;
  const LatticeBits& marks_;
  bool remembers_;
  std::vector<std::vector<Tetrahedron>> sharing_;
  std::vector<Answer> answers_;
};

void expect_the_recursion(const Box& domain, int cube_size, int marks, std::uint64_t seed, bool remembers) {
  const LatticeBits marked = random_marks(domain, marks, seed);
  PaperRecursion recursion(domain, cube_size, marked, remembers);
  LatticeBits active = marked;
  close_under_parents(active, cube_size);
  for_each_point(domain, [&](Index3 p) {
    const bool root_corner = classify(p, cube_size).odd == 0;
    ASSERT_EQ(active.test(p), root_corner || recursion.requires_subdivision(p))
        << "S " << cube_size << " marks " << marks << " at " << p.x << ' ' << p.y << ' ' << p.z;
  });
}

TEST(Closure, IsWhatThePapersRecursionDecides) {
  expect_the_recursion({{0, 0, 0}, {8, 4, 4}}, 4, 0, 1, false);  // the longest search: it finds nothing
  for (const int marks : {1, 2, 4, 20})
    for (std::uint64_t seed = 0; seed < 3; ++seed) {
      expect_the_recursion({{0, 0, 0}, {4, 4, 4}}, 4, marks, seed, false);
      expect_the_recursion({{0, 0, 0}, {8, 4, 8}}, 4, marks, seed, false);
    }
}

// The same recursion with its answers remembered, which makes larger root cubes possible.
TEST(Closure, IsWhatThePapersRecursionDecidesForLargerCubes) {
  for (const int marks : {1, 3, 10, 100})
    for (std::uint64_t seed = 0; seed < 3; ++seed) {
      expect_the_recursion({{0, 0, 0}, {12, 8, 12}}, 4, marks, seed, true);
      expect_the_recursion({{0, 0, 0}, {16, 16, 16}}, 8, marks, seed, true);
      expect_the_recursion({{0, 0, 0}, {16, 16, 32}}, 16, marks, seed, true);
    }
}

// The smallest closed set: only the root corners, the marks, and the points that these require are active.
TEST(Closure, IsMinimalForCubesOfEverySize) {
  struct Size {
    int cube_size;
    Index3 cubes;
  };
  for (const auto& [s, cubes] :
       {Size{4, {5, 3, 2}}, Size{4, {40, 1, 1}}, Size{8, {3, 4, 3}}, Size{16, {5, 2, 2}}, Size{32, {3, 1, 2}},
        Size{64, {2, 2, 2}}, Size{128, {2, 1, 1}}, Size{128, {1, 2, 1}}, Size{256, {1, 1, 1}}})
    for (const int marks : {0, 1, 7, 300}) {
      const Box box{{0, 0, 0}, {s * cubes.x, s * cubes.y, s * cubes.z}};
      LatticeBits bits = random_marks(box, marks, static_cast<std::uint64_t>(s + marks)), expected = bits;
      close_under_parents(bits, s);
      oracle::close_under_parents(expected, s);
      ASSERT_TRUE(bits == expected) << "S " << s << " marks " << marks;
      EXPECT_TRUE(s > 64 || is_conforming(bits, box, s));
    }
}

TEST(Closure, DoesNotDependOnWhereTheBoxLies) {
  for (const int s : {4, 8, 64})
    for (const Index3 shift : {Index3{s, 0, 0}, Index3{0, 3 * s, s}, Index3{5 * s, s, 2 * s}}) {
      const Box box{{0, 0, 0}, {2 * s, s, 2 * s}}, moved{shift, box.high + shift};
      LatticeBits here(box), there(moved);
      const LatticeBits marks = random_marks(box, 40, 3);
      for_each_point(box, [&](Index3 p) {
        if (!marks.test(p)) return;
        here.set(p);
        there.set(p + shift);
      });
      close_under_parents(here, s);
      close_under_parents(there, s);
      EXPECT_TRUE(std::equal(here.words().begin(), here.words().end(), there.words().begin())) << s;
    }
}

TEST(Closure, OfNestedSetsIsThatOfEach) {
  for (const int s : {4, 16, 64})
    for (const int marks : {0, 2, 40}) {
      const Box box{{0, 0, 0}, {2 * s, 3 * s, s}};
      std::array<LatticeBits, 3> nested;
      for (std::size_t i = nested.size(); i-- > 0;) {
        nested[i] = random_marks(box, marks, static_cast<std::uint64_t>(s) + i);
        for (std::size_t word = 0; i + 1 < nested.size() && word < nested[i].words().size(); ++word)
          nested[i].words()[word] |= nested[i + 1].words()[word];
      }
      std::array<LatticeBits, 3> expected = nested;
      close_under_parents(nested, s);
      for (std::size_t i = 0; i < nested.size(); ++i) {
        oracle::close_under_parents(expected[i], s);
        EXPECT_TRUE(nested[i] == expected[i]) << s << ' ' << marks << ' ' << i;
      }
    }
}

TEST(Closure, OfAClosedSetIsTheSet) {
  for (const int s : {4, 16, 64}) {
    LatticeBits once = random_marks({{0, 0, 0}, {2 * s, s, s}}, 30, 9);
    close_under_parents(once, s);
    LatticeBits twice = once;
    close_under_parents(twice, s);
    EXPECT_TRUE(once == twice);
  }
}

// Subdivides every brick alone from the marks of its region, and compares with the whole volume.
void expect_bricks_agree(Index3 dims, int cube_size, int edge, int marks, std::uint64_t seed) {
  const BrickGrid bricks{{dims, cube_size}, edge};
  const Domain& domain = bricks.domain;
  const LatticeBits marked = random_marks(domain.padded(), marks, seed);
  LatticeBits whole = marked;
  oracle::close_under_parents(whole, cube_size);
  for (std::int64_t id = 0; id < bricks.count(); ++id) {
    const Box box = bricks.closed_box(bricks.position(id));
    const Box region = region_of_marks(box, domain);
    LatticeBits marks_of_region(region), expected(box);
    copy_bits(marked, marks_of_region);
    copy_bits(whole, expected);
    ASSERT_TRUE(subdivide(std::move(marks_of_region), box, domain) == expected)
        << "dims " << dims.x << ' ' << dims.y << ' ' << dims.z << " S " << cube_size << " edge " << edge
        << " brick " << id;
  }
}

RC_GTEST_PROP(Subdivide, EveryBrickAloneDecidesAsTheWholeVolume, ()) {
  const int s = *rc::gen::element(4, 8, 16);
  const auto length = [&] { return std::int64_t{*rc::gen::inRange(1, 4 * s + 2)}; };
  const Index3 dims{length(), length(), length()};
  const auto n = static_cast<int>(Domain{dims, s}.padded().count());
  const int marks = *rc::gen::element(0, 1, 3, n / 1000, n / 100, n / 10);
  expect_bricks_agree(dims, s, *rc::gen::inRange(1, 4), marks, *rc::gen::arbitrary<std::uint64_t>());
}

TEST(Subdivide, HoldsForVolumesOfAwkwardSizes) {
  for (const int edge : {1, 2, 3})
    for (const Index3 dims :
         {Index3{1, 1, 1}, {2, 2, 2}, {7, 1, 30}, {33, 33, 1}, {1, 1, 65}, {17, 18, 16}, {31, 2, 47}}) {
      expect_bricks_agree(dims, 8, edge, 5, 1);
      expect_bricks_agree(dims, 8, edge, 100, 2);
      expect_bricks_agree(dims, 32, edge, 20, 3);
    }
}

// Rows of several words, units that move whole words.
TEST(Subdivide, HoldsForLargeRootCubes) {
  expect_bricks_agree({130, 200, 70}, 64, 1, 60, 1);
  expect_bricks_agree({200, 66, 129}, 64, 2, 60, 2);
  expect_bricks_agree({258, 129, 20}, 128, 1, 60, 3);
}

TEST(RegionOfMarks, StaysInTheDomainAndReachesOneCube) {
  const Domain domain{{100, 33, 5}, 16};
  EXPECT_EQ(region_of_marks({{32, 0, 0}, {64, 32, 16}}, domain), (Box{{16, 0, 0}, {80, 32, 16}}));
  EXPECT_EQ(region_of_marks(domain.padded(), domain), domain.padded());
}

}  // namespace
}  // namespace tagrid
