// The edges that are found in a field: each once, with the values that the hierarchy and the field say it has.
#include "stages/criterion/find_edges.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>

#include "stages/grid/lattice_bits.h"
#include "tests/support/curvature_of.h"
#include "tests/support/oracle.h"

namespace tagrid {
namespace {

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
      for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
        for (std::int64_t y = box.low.y; y <= box.high.y; ++y)
          for (std::int64_t x = box.low.x; x <= box.high.x; ++x)
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
