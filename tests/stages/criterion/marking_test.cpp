// Marks of volumes, and the edges that are found in fields.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>
#include <map>
#include <set>

#include "stages/criterion/find_edges.h"
#include "stages/criterion/marking.h"
#include "stages/grid/lattice_bits.h"
#include "tests/support/conforming_activity.h"
#include "tests/support/encode_volume.h"
#include "tests/support/oracle.h"
#include "tests/support/points.h"
#include "tests/support/sanitized.h"

namespace tagrid {
namespace {

// Marks of whole volumes agree with the oracle, whatever the size of the volume, its tiles, and the level
// limit.

// Blobs, edges and noise: all kinds of content that cause marks.
template <class T>
oracle::Volume<T> lively_volume(Index3 dims, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const double half = 0.25 * std::numeric_limits<T>::max() * (std::numeric_limits<T>::is_signed ? 2 : 1);
  const double middle = std::numeric_limits<T>::is_signed ? 0 : 2 * half;
  const double a = 0.1 + 0.01 * static_cast<double>(random() % 40), wall = static_cast<double>(random() % 20);
  return oracle::volume_of<T>(dims, [&](double x, double y, double z) {
    const double smooth = std::sin(a * x) * std::cos(0.7 * a * y + 0.3 * z);
    const double step = x + 0.5 * y > wall ? 0.3 : -0.3;
    const double noise = (z > 6) * 0.02 * (static_cast<double>(random() % 200) / 100 - 1);
    return middle + half * (0.6 * smooth + step + noise);
  });
}

template <class T>
class Marks : public testing::Test {
 public:
  static double field_scale() {
    return 8.0 / (std::numeric_limits<T>::max() - std::numeric_limits<T>::min() + 1.0);
  }
};
TYPED_TEST_SUITE(Marks, NarrowTypes);

TYPED_TEST(Marks, EqualTheOracleAtEveryPoint) {
  const double scale = TestFixture::field_scale();
  std::int64_t marked = 0, compared = 0, near = 0;
  for (const int s : {4, 8, 16})
    for (const Index3 dims :
         {Index3{1, 1, 1}, {2, 1, 9}, {19, 6, 30}, {5, 33, 1}, {141, 3, 4}, {17, 17, 17}}) {
      const auto volume = lively_volume<TypeParam>(dims, static_cast<std::uint64_t>(dims.x * s));
      const Domain domain{dims, s};
      const LatticeBits marks = marks_of(volume, s, {20, scale, 24});
      for_each_point(domain.padded(), [&](Index3 p) {
        if (!domain.volume().contains(p) || classify(p, s).odd == 0) {
          ASSERT_FALSE(marks.test(p));
          return;
        }
        const double ratio = oracle::arc_over_chord_at(volume, p, s, scale, 20);
        ++compared;
        marked += marks.test(p);
        if (std::abs(ratio / oracle::threshold(20) - 1) <= 1e-4)
          ++near;
        else
          ASSERT_EQ(marks.test(p), ratio > oracle::threshold(20))
              << "S " << s << " at " << p.x << ' ' << p.y << ' ' << p.z << " ratio " << ratio;
      });
    }
  EXPECT_GT(marked, compared / 20);
  EXPECT_LT(marked, compared - compared / 20);
  EXPECT_LT(near, compared / 50);
}

RC_GTEST_PROP(MarksOfATile, AreThoseOfTheWholeVolume, ()) {
  const int s = *rc::gen::element(4, 8, 16);
  const Index3 dims{*rc::gen::inRange(1, 50), *rc::gen::inRange(1, 40), *rc::gen::inRange(1, 30)};
  const auto volume = lively_volume<std::int16_t>(dims, *rc::gen::arbitrary<std::uint64_t>());
  const Domain domain{dims, s};
  const MarkingParameters parameters{*rc::gen::element(6, 20, 60), 8.0 / 65536, 24};
  const LatticeBits whole = marks_of(volume, s, parameters);
  // A box of whole root cubes, and any box of points in it.
  Box cubes, box;
  for (int axis = 0; axis < 3; ++axis) {
    const auto n = static_cast<int>(domain.cubes(axis));
    const int first = *rc::gen::inRange(0, n), last = *rc::gen::inRange(first, n);
    cubes.low[axis] = std::int64_t{first} * s;
    cubes.high[axis] = std::int64_t{last + 1} * s;
    box.low[axis] = *rc::gen::inRange(cubes.low[axis], cubes.high[axis] + 1);
    box.high[axis] = *rc::gen::inRange(box.low[axis], cubes.high[axis] + 1);
  }
  const LatticeBits tile = marks_of(volume, s, parameters, cubes, box);
  for_each_point(box, [&](Index3 p) { RC_ASSERT(tile.test(p) == whole.test(p)); });
}

TEST(MarkCurvature, LeavesOtherBitsAsTheyAre) {
  const auto volume = lively_volume<std::uint8_t>({19, 18, 17}, 3);
  const Domain domain{volume.dims, 8};
  const Box box = domain.padded(), read = box.grown(CurvatureField::halo);
  const auto samples = volume.cut(read);
  const auto mark = [&](LatticeBits& marks) {
    mark_curvature(Samples<std::uint8_t>{read, samples.data()}, box, domain, {20, 8.0 / 256, 24}, marks);
  };
  LatticeBits marks(box), expected(box), before(box);
  for_each_point(box, [&](Index3 p) {
    if ((p.x * 7 + p.y * 3 + p.z) % 5 == 0) before.set(p);
  });
  marks = before;
  mark(marks);
  mark(expected);
  for_each_point(box, [&](Index3 p) { ASSERT_EQ(marks.test(p), before.test(p) || expected.test(p)); });
}

TEST(MarkCurvature, ALimitedRunMarksTheSamePointsUpToItsLevel) {
  const auto volume = lively_volume<std::int16_t>({37, 20, 33}, 5);
  const LatticeBits all = marks_of(volume, 16, {20, 8.0 / 65536, 24});
  for (int level = 0; level <= 12; ++level) {
    const LatticeBits limited = marks_of(volume, 16, {20, 8.0 / 65536, level});
    for_each_point(all.box(), [&](Index3 p) {
      ASSERT_EQ(limited.test(p), all.test(p) && classify(p, 16).level <= level) << "level " << level;
    });
  }
}

TEST(MarkCurvature, ALargerMNeverMarksLess) {
  const auto volume = lively_volume<std::int16_t>({33, 33, 33}, 8);
  std::int64_t last = 0;
  for (const int m : {3, 6, 10, 20, 40, 100, 1000}) {
    const std::int64_t count = count_of(marks_of(volume, 16, {m, 8.0 / 65536, 24}));
    EXPECT_GE(count, last) << m;
    last = count;
  }
  EXPECT_GT(last, 0);
}

// The edges that are found in a field: each once, with the values that the hierarchy and the field say it has.

constexpr float scale = 0.37F, rise_scale = scale / CurvatureField::value_divisor;

/// Finds every edge, unless its values are no numbers.
VarianceTest every_edge() {
  VarianceTest test(20);
  test.limit = -std::numeric_limits<float>::infinity();
  return test;
}

/// Calls f(number of the point, edges, i) for every edge that the test finds among the points of `box`.
template <class Test, class F>
void for_each_found(CurvatureField field, const Box& box, int cube_size, const Test& test, F f) {
  const LatticeBits bits(box);
  for (std::int64_t unit = 1; unit < cube_size; unit *= 2) {
    if (unit > 1) {
      CurvatureField thinned(field.box, 2 * unit, (field.size.z + 1) / 2);
      for (std::int64_t z = field.box.low.z; z <= field.box.high.z; z += 2 * unit)
        thin_out(field, z, thinned);
      field = std::move(thinned);
    }
    const auto find = [&](const PointsOfSlice& points) {
      EdgePlace place;
      for (bool all = false; !all;) {
        FoundEdges found;  // several are needed for most slices
        all = find_edges({field, rise_scale, points, numbers_of(points, bits)}, test, place, found);
        for (std::size_t i = 0; i < found.count; ++i) f(found.points[i], found.edges, i);
      }
    };
    for (std::int64_t z = field.box.low.z; z <= field.box.high.z; z += unit)
      for_each_class_of_points(box, cube_size, std::numeric_limits<int>::max(), unit, z, find);
  }
}

TEST(FindEdges, FindsEveryEdgeOnceWithTheValuesOfTheField) {
  std::mt19937_64 random(5);
  const auto volume = oracle::volume_of<double>({40, 37, 38}, [&](double x, double y, double z) {
    return 9 * std::sin(0.3 * x + 0.2 * y) + z - x + 3 * (static_cast<double>(random() % 2000) / 1000 - 1);
  });
  const Box cubes{{0, 0, 0}, {32, 32, 32}};
  for (const int cube_size : {4, 16})
    for (const Box& box : {cubes, Box{{5, 3, 7}, {29, 32, 8}}, Box{{16, 0, 2}, {16, 32, 2}}}) {
      std::set<std::uint32_t> seen;
      const LatticeBits bits(box);
      std::map<std::uint32_t, Index3> point_of;
      for (const auto [x, y, z] : points_of(box))
        if (classify({x, y, z}, cube_size).odd > 0)
          point_of[static_cast<std::uint32_t>(bits.bit_of({x, y, z}))] = {x, y, z};
      for_each_found(curvature_of(volume, cubes, scale), box, cube_size, every_edge(),
                     [&](std::uint32_t number, const EdgeBatch& edges, std::size_t i) {
                       ASSERT_TRUE(point_of.contains(number));
                       EXPECT_TRUE(seen.insert(number).second);
                       const Index3 p = point_of[number];
                       const BaseEdge ends = base_edge(p, classify(p, cube_size), cube_size);
                       const oracle::Edge e = oracle::edge_between(volume, ends.left, ends.right, scale);
                       EXPECT_NEAR(edges.length[i], e.length, 1e-5 * e.length);
                       EXPECT_NEAR(edges.rise[i], e.rise, 1e-3);
                       EXPECT_NEAR(edges.slope_left[i], e.slope_left, 1e-4);
                       EXPECT_NEAR(edges.slope_right[i], e.slope_right, 1e-4);
                       EXPECT_NEAR(edges.bend_left[i], e.bend_left, 1e-4);
                       EXPECT_NEAR(edges.bend_right[i], e.bend_right, 1e-4);
                     });
      EXPECT_EQ(seen.size(), point_of.size());
    }
}

TEST(FindEdges, InAConstantFieldFindsAtMostWhatIsNotFinite) {
  for (const double odd :
       {7.0, std::numeric_limits<double>::quiet_NaN(), -std::numeric_limits<double>::quiet_NaN(),
        std::numeric_limits<double>::infinity()}) {
    oracle::Volume<double> volume =
        oracle::volume_of<double>({20, 20, 20}, [](double, double, double) { return 7; });
    volume.samples[static_cast<std::size_t>(Box::of_size(volume.dims).offset({8, 9, 7}))] = odd;
    const Box box{{0, 0, 0}, {16, 16, 16}};
    const auto expect_not_finite = [](std::uint32_t, const EdgeBatch& edges, std::size_t i) {
      EXPECT_FALSE(std::isfinite(edges.rise[i] + edges.slope_left[i] + edges.slope_right[i] +
                                 edges.bend_left[i] + edges.bend_right[i]));
    };
    for_each_found(curvature_of(volume, box, scale), box, 8, BentTest(CriterionParameters(20)),
                   expect_not_finite);
    for_each_found(curvature_of(volume, box, scale), box, 8, VarianceTest(20), expect_not_finite);
  }
}

}  // namespace
}  // namespace tagrid
