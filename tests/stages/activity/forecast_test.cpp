// The forecast of the activity, from decoded samples, compared with a plain implementation of its definition.
#include "stages/activity/forecast.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "stages/grid/lattice.h"
#include "tests/support/brick_samples.h"
#include "tests/support/conforming_activity.h"
#include "tests/support/encode_volume.h"

namespace tagrid {
namespace {

CodingParameters parameters_of(Index3 dims, SampleType type, int cube_size, double field_scale) {
  CodingParameters p{.dims = dims,
                     .type = type,
                     .cube_size = cube_size,
                     .max_level = max_level(cube_size),
                     .field_scale = field_scale};
  return p;
}

// The forecast of a point.
std::size_t at(const Forecast& forecast, Index3 p) {
  std::size_t value = 0;
  for (int level = 1; level <= Forecast::levels; ++level) value += forecast.at_least(level).test(p);
  return value;
}

/// The samples that a brick owns, in voxels; elsewhere the nearest of them.
using Heights = std::function<double(Index3)>;

/// Derivatives of the uniform cubic B-spline with these coefficients, along the direction `e` of length |e|.
struct End {
  double value = 0, slope = 0, bend = 0;
};
End end_at(const Heights& heights, Index3 q, Index3 e) {
  constexpr double weight[3][3] = {{1 / 6.0, 4 / 6.0, 1 / 6.0}, {-0.5, 0, 0.5}, {1, -2, 1}};
  const auto stencil = [&](int x, int y, int z) {
    double sum = 0;
    for (int k = -1; k <= 1; ++k)
      for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i)
          sum += weight[x][i + 1] * weight[y][j + 1] * weight[z][k + 1] * heights(q + Index3{i, j, k});
    return sum;
  };
  const auto k = static_cast<double>(e.x * e.x + e.y * e.y + e.z * e.z);
  const auto x = static_cast<double>(e.x), y = static_cast<double>(e.y), z = static_cast<double>(e.z);
  return {stencil(0, 0, 0),
          (x * stencil(1, 0, 0) + y * stencil(0, 1, 0) + z * stencil(0, 0, 1)) / std::sqrt(k),
          (x * x * stencil(2, 0, 0) + y * y * stencil(0, 2, 0) + z * z * stencil(0, 0, 2) +
           2 * (x * y * stencil(1, 1, 0) + x * z * stencil(1, 0, 1) + y * z * stencil(0, 1, 1))) /
              k};
}

/// The base edge of a point, with what the criterion looks at.
oracle::Edge edge_of(const Heights& heights, Index3 p, int cube_size) {
  const PointClass c = classify(p, cube_size);
  const BaseEdge edge = base_edge(p, c, cube_size);
  const Index3 d = edge.right - edge.left, e{d.x / (2 * c.unit), d.y / (2 * c.unit), d.z / (2 * c.unit)};
  const double length = std::sqrt(static_cast<double>(d.x * d.x + d.y * d.y + d.z * d.z));
  const End left = end_at(heights, edge.left, e), right = end_at(heights, edge.right, e);
  return {length, right.value - left.value, left.slope, left.bend, right.slope, right.bend};
}

/// The variance of the slope of the spline through the six control points, as a multiple of the threshold.
double variance_of(const oracle::Edge& edge, int accuracy) {
  const double third = edge.length / 3, chord = edge.rise / edge.length;
  // Heights of the control points, relative to the chord, and the slopes of the legs between them.
  const auto control = [&](double slope, double bend, double step) {
    return step * (slope - chord) + step * step * bend / 2;
  };
  const double points[6] = {control(edge.slope_left, edge.bend_left, -third),
                            0,
                            control(edge.slope_left, edge.bend_left, third),
                            control(edge.slope_right, edge.bend_right, -third),
                            0,
                            control(edge.slope_right, edge.bend_right, third)};
  double legs[5];
  for (int i = 0; i < 5; ++i) legs[i] = (points[i + 1] - points[i]) / third;
  double variance = 0;  // by Gauss's rule with three nodes a segment, exact for this polynomial
  for (int segment = 0; segment < 3; ++segment)
    for (const auto& [t, w] :
         {std::pair{0.5 - std::sqrt(0.15), 5 / 18.0}, {0.5, 8 / 18.0}, {0.5 + std::sqrt(0.15), 5 / 18.0}}) {
      const double slope = (1 - t) * (1 - t) / 2 * legs[segment] + (0.5 + t - t * t) * legs[segment + 1] +
                           t * t / 2 * legs[segment + 2];
      variance += w * slope * slope / 3;
    }
  const double stretch = 1 + chord * chord, angle = std::acos(-1.0) / accuracy;
  return variance / (stretch * stretch) / (angle * angle / 3);
}

struct Compared {
  std::size_t points = 0, exceeding[Forecast::levels] = {};
};

template <class T>
Compared compare_with_definition(const oracle::Volume<T>& volume, const CodingParameters& p) {
  Compared compared;
  for (std::int64_t id = 0; id < p.bricks().count(); ++id) {
    const Index3 brick = p.bricks().position(id);
    const Box box = p.bricks().closed_box(brick), owned = p.bricks().owned_box(brick);
    const Forecast forecast = forecast_activity<T>(volume.cut(owned), p, brick);
    const Heights heights = [&](Index3 q) {
      const double height = (static_cast<double>(volume.at(owned.nearest(q))) - p.range_low) * p.field_scale;
      return std::isfinite(height) ? height : std::numeric_limits<double>::quiet_NaN();
    };
    // Near a threshold, both results are right: the counts that are allowed, and those that are required.
    const double thresholds[] = {0.6, 1, 1.6};
    std::array<LatticeBits, Forecast::levels> may, must;
    for (std::size_t level = 0; level < Forecast::levels; ++level) {
      may[level] = must[level] = LatticeBits(box);
      for_each_point(box, [&](Index3 q) {
        const PointClass c = classify(q, p.cube_size);
        if (c.odd == 0 || c.level > p.max_level || !p.domain().volume().contains(q)) return;
        const oracle::Edge edge = edge_of(heights, q, p.cube_size);
        const double variance = variance_of(edge, p.accuracy);
        if (!(variance > 0.498)) return;
        const double excess =
            (oracle::arc_over_chord(edge, p.accuracy) - 1) / (oracle::threshold(p.accuracy) - 1);
        if (excess > 0.998 * thresholds[level]) may[level].set(q);
        if (excess > 1.002 * thresholds[level] && variance > 0.502) must[level].set(q);
      });
      oracle::close_under_parents(may[level], p.cube_size);
      oracle::close_under_parents(must[level], p.cube_size);
    }
    for_each_point(box, [&](Index3 q) {
      if (classify(q, p.cube_size).odd == 0) return;  // nobody asks
      ++compared.points;
      const std::size_t value = at(forecast, q);
      for (std::size_t level = 0; level < Forecast::levels; ++level) {
        compared.exceeding[level] += value > level;
        ASSERT_TRUE(value <= level || may[level].test(q)) << q.x << ' ' << q.y << ' ' << q.z;
        ASSERT_TRUE(value > level || !must[level].test(q)) << q.x << ' ' << q.y << ' ' << q.z;
      }
    });
  }
  return compared;
}

template <class T>
oracle::Volume<T> blobs(Index3 dims, double middle, double half) {
  return oracle::volume_of<T>(dims, [&](double x, double y, double z) {
    return middle + half * (std::sin(0.31 * x + 0.1 * z) * std::cos(0.23 * y) + (x + y > 2 * z ? 0.5 : 0.1));
  });
}

TEST(ActivityForecast, IsItsDefinitionForBricksOfAllShapes) {
  for (const int cube_size : {4, 8, 16})
    for (const Index3 dims : {Index3{1, 1, 1}, {19, 6, 30}, {5, 33, 1}, {35, 20, 18}}) {
      SCOPED_TRACE(testing::Message() << cube_size << ": " << dims.x << ' ' << dims.y << ' ' << dims.z);
      const auto volume = blobs<std::int16_t>(dims, 100, 1000);
      const auto compared =
          compare_with_definition(volume, parameters_of(dims, SampleType::int16, cube_size, 8.0 / 4096));
      if (dims == Index3{35, 20, 18}) {
        EXPECT_GT(compared.exceeding[2], compared.points / 50);
        EXPECT_LT(compared.exceeding[0], compared.points);
        EXPECT_LT(compared.exceeding[2], compared.exceeding[0]);
      }
    }
}

// The bounds rule out most rows; few of the others are close to them.
TEST(ActivityForecast, IsItsDefinitionWhereLittleBends) {
  const Index3 dims{35, 22, 21};
  for (const double half : {20.0, 60.0, 150.0}) {
    const auto volume = blobs<std::int16_t>(dims, 100, half);
    for (const int accuracy : {5, 20, 100}) {
      CodingParameters p = parameters_of(dims, SampleType::int16, 16, 8.0 / 4096);
      p.accuracy = accuracy;
      const auto compared = compare_with_definition(volume, p);
      EXPECT_LT(compared.exceeding[0], compared.points);
      if (half > 100 && accuracy > 5) {
        EXPECT_GT(compared.exceeding[0], 0U);
      }
    }
  }
}

TEST(ActivityForecast, LongRowsAreLoadedInPieces) {
  const Index3 dims{257, 9, 8};
  const auto compared = compare_with_definition(blobs<std::uint8_t>(dims, 120, 50),
                                                parameters_of(dims, SampleType::uint8, 128, 8.0 / 256));
  EXPECT_GT(compared.exceeding[2], 0U);
}

TEST(ActivityForecast, IsItsDefinitionForWideTypes) {
  const Index3 dims{20, 17, 18};
  CodingParameters p = parameters_of(dims, SampleType::float64, 8, 8.0 / 4096);
  p.range_low = -1000;
  EXPECT_GT(compare_with_definition(blobs<double>(dims, 100, 1000), p).exceeding[2], 0U);
  p.type = SampleType::int32;
  EXPECT_GT(compare_with_definition(blobs<std::int32_t>(dims, 100, 1000), p).exceeding[2], 0U);
}

TEST(ActivityForecast, NoPointAboveTheLevelLimitIsForecast) {
  const Index3 dims{33, 33, 33};
  CodingParameters p = parameters_of(dims, SampleType::int16, 16, 1);
  p.max_level = 7;
  const auto compared = compare_with_definition(blobs<std::int16_t>(dims, 100, 1000), p);
  EXPECT_GT(compared.exceeding[2], 0U);
}

TEST(ActivityForecast, AConstantBrickForecastsNothing) {
  const CodingParameters p = parameters_of({40, 40, 40}, SampleType::int16, 32, 1);
  const std::vector<std::int16_t> samples(40 * 40 * 40, 77);
  const Forecast forecast = forecast_activity<std::int16_t>(samples, p, {0, 0, 0});
  EXPECT_TRUE(forecast.exists());
  const Box box = p.bricks().closed_box({0, 0, 0});
  for_each_point(box, [&](Index3 q) {
    if (classify(q, 32).odd != 0) {
      ASSERT_EQ(at(forecast, q), 0U);
    }
  });
}

// Samples that are not finite: edges near them exceed nothing, the others what they always do.
TEST(ActivityForecast, IsItsDefinitionNearSamplesThatAreNotFinite) {
  const Index3 dims{20, 17, 18};
  auto volume = blobs<double>(dims, 100, 1000);
  volume.samples[700] = std::numeric_limits<double>::quiet_NaN();
  volume.samples[3000] = std::numeric_limits<double>::infinity();
  EXPECT_GT(
      compare_with_definition(volume, parameters_of(dims, SampleType::float64, 8, 8.0 / 4096)).exceeding[2],
      0U);
}

TEST(ActivityForecast, AVolumeWithoutAFiniteSampleForecastsNothing) {
  const Index3 dims{17, 17, 17};
  for (const double odd : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                           std::numeric_limits<double>::max()}) {
    const CodingParameters p = parameters_of(dims, SampleType::float64, 16, 1e300);
    const std::vector<double> samples(17 * 17 * 17, odd);
    const Forecast forecast = forecast_activity<double>(samples, p, {0, 0, 0});
    const Box box = p.bricks().closed_box({0, 0, 0});
    for_each_point(box, [&](Index3 q) {
      if (classify(q, 16).odd != 0) {
        ASSERT_EQ(at(forecast, q), 0U);
      }
    });
  }
}

// The purpose: of lossless samples, the forecast is the result of the criterion and its closure, but for edges
// that need samples that the brick does not own.
TEST(ActivityForecast, IsMostlyTheActivity) {
  const Index3 dims{97, 65, 65};
  const auto volume = random_volume<std::int16_t>(dims, 2);
  const CodingParameters p = parameters_of(dims, SampleType::int16, 32, 8.0 / 65536);
  const LatticeBits active = activity_of(volume, 32, {20, p.field_scale, p.max_level});
  std::size_t points = 0, right = 0, on = 0;
  for (std::int64_t id = 0; id < p.bricks().count(); ++id) {
    const Index3 brick = p.bricks().position(id);
    const Box box = p.bricks().closed_box(brick);
    const Forecast forecast =
        forecast_activity<std::int16_t>(volume.cut(p.bricks().owned_box(brick)), p, brick);
    for_each_point(box, [&](Index3 q) {
      ++points;
      on += active.test(q);
      right += active.test(q) == (at(forecast, q) >= 2);
    });
  }
  EXPECT_GT(on, points / 20);
  EXPECT_LT(on, points - points / 20);
  EXPECT_GT(right, points - points / 40);
}

}  // namespace
}  // namespace tagrid
