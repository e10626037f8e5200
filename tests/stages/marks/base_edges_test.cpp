// The bounds of a row of base edges, compared with the edges themselves.
#include "stages/marks/base_edges.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "tests/support/oracle.h"

namespace tagrid {
namespace {

template <class T>
CurvatureField field_of(const oracle::Volume<T>& volume, const Box& box, double scale) {
  const Box read = box.grown(CurvatureField::halo);
  const std::vector<T> samples = volume.cut(read);
  CurvatureField field;
  evaluate_curvature(Samples<T>{read, samples.data()}, box, scale, field);
  return field;
}

/// Calls f(bounds, edges, their number, their length) for every row.
template <class F>
void for_each_batch(const CurvatureField& field, int cube_size, float rise_scale, F f) {
  for_each_row_of_edges(field.box, cube_size, std::numeric_limits<int>::max(), [&](const RowOfEdges& row) {
    const EdgeBounds bounds = bounds_of(field, row, rise_scale);
    for (std::int64_t from = 0; from < row.count; from += EdgeBatch::capacity) {
      const std::int64_t n = std::min<std::int64_t>(row.count - from, EdgeBatch::capacity);
      EdgeBatch edges{};
      load_edges(field, row, from, n, rise_scale, edges);
      f(bounds, edges, static_cast<std::size_t>(n),
        std::sqrt(static_cast<float>(row.odd)) * static_cast<float>(2 * row.unit));
    }
  });
}

TEST(BaseEdges, NoEdgeExceedsTheBoundsOfItsRow) {
  std::mt19937_64 random(5);
  std::size_t edges_seen = 0, near = 0;
  for (const double noise : {0.0, 3.0, 30000.0})
    for (const int cube_size : {4, 16}) {
      const auto volume = oracle::volume_of<std::int16_t>({40, 37, 38}, [&](double x, double y, double z) {
        return 9 * std::sin(0.3 * x + 0.2 * y) + z - x +
               noise * (static_cast<double>(random() % 2000) / 1000 - 1);
      });
      const float scale = 0.37F, rise_scale = scale / CurvatureField::value_divisor;
      const CurvatureField field = field_of(volume, {{0, 0, 0}, {32, 32, 32}}, scale);
      for_each_batch(field, cube_size, rise_scale,
                     [&](const EdgeBounds& bounds, const EdgeBatch& edges, std::size_t n, float length) {
                       for (std::size_t i = 0; i < n; ++i) {
                         ++edges_seen;
                         ASSERT_LE(std::fabs(edges.slope_left[i]), bounds.slope);
                         ASSERT_LE(std::fabs(edges.slope_right[i]), bounds.slope);
                         ASSERT_LE(std::fabs(edges.bend_left[i]), bounds.bend);
                         ASSERT_LE(std::fabs(edges.bend_right[i]), bounds.bend);
                         ASSERT_LE(std::fabs(edges.rise[i]) / length, bounds.chord);
                         near += std::fabs(edges.slope_left[i]) > 0.9F * bounds.slope;
                       }
                     });
    }
  EXPECT_GT(near, edges_seen / 1000);  // bounds are not larger than necessary
}

TEST(BaseEdges, AConstantFieldHasBoundsOfZero) {
  const auto volume =
      oracle::volume_of<std::int16_t>({20, 20, 20}, [](double, double, double) { return -7; });
  const CurvatureField field = field_of(volume, {{0, 0, 0}, {16, 16, 16}}, 2);
  for_each_batch(field, 8, 1, [](const EdgeBounds& bounds, const EdgeBatch&, std::size_t, float) {
    ASSERT_EQ(bounds.slope, 0);
    ASSERT_EQ(bounds.chord, 0);
    ASSERT_EQ(bounds.bend, 0);
  });
}

TEST(BaseEdges, NothingBoundsWhatIsNotFinite) {
  for (const double odd :
       {std::numeric_limits<double>::quiet_NaN(), -std::numeric_limits<double>::quiet_NaN(),
        std::numeric_limits<double>::infinity()}) {
    oracle::Volume<double> volume =
        oracle::volume_of<double>({20, 20, 20}, [](double x, double y, double z) { return x + y * z; });
    volume.samples[static_cast<std::size_t>(Box::of_size(volume.dims).offset({8, 9, 7}))] = odd;
    std::size_t unbounded = 0;
    for_each_batch(field_of(volume, {{0, 0, 0}, {16, 16, 16}}, 1), 8, 1,
                   [&](const EdgeBounds& bounds, const EdgeBatch& edges, std::size_t n, float) {
                     const float sum = bounds.slope + bounds.chord + bounds.bend;
                     unbounded += !std::isfinite(sum);
                     for (std::size_t i = 0; i < n; ++i)
                       if (!std::isfinite(edges.rise[i] + edges.slope_left[i] + edges.slope_right[i] +
                                          edges.bend_left[i] + edges.bend_right[i])) {
                         ASSERT_FALSE(std::isfinite(sum));
                       }
                   });
    EXPECT_GT(unbounded, 0U);
  }
}

}  // namespace
}  // namespace tagrid
