// Finds the base edges that have to be measured (criterion.h) by one of two fast tests, a vector of edges at
// a time. The arithmetic of the tests is in find_edges.cpp.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "stages/criterion/base_edges.h"
#include "stages/criterion/criterion.h"
#include "stages/criterion/curvature.h"
#include "stages/grid/lattice_bits.h"

namespace tagrid {

/// Finds all edges that can violate the criterion, and some more.
///
/// Let d be the direction from one end of the curve to the other, w their distance, and t(j) the angle
/// between d and leg j of the control polygon. The spline is made of the legs with weights W = (1, 5, 6, 5,
/// 1) / 6, so
///
///   R - C  <=  sum of W(j) |leg j| (1 - cos t(j))  <=  sum of W(j) |leg j| t(j)^2 / 2.
///
/// The outer legs are no longer than a step, hence w/3. The middle leg is what they leave of the way: at
/// least w/3 along d, and beside d at most as far as they are. Let a be the angle between d and the tangent
/// at an end, and b half the angle of a step there, with the sign of the second derivative: then the angles
/// of the outer legs are a - b and a + b, and
///
///   R - C  <=  w/6 (a^2 + b^2 + 4/3 ab  +  a'^2 + b'^2 - 4/3 a'b'  +  (a + b + a' - b')^2)  =  w/6 S,
///
/// where the right end has a dash, and products and sums are what they are at most if any of the angles is
/// smaller than it is said to be. Finally C >= w (1 - S/9). So there is no violation if S <= `limit`.
///
/// Let c be the slope of the chord, s that of the tangent, and e = |s - c| <= 1/2. Then the angle a is at
/// most e (1 + 3/4 e) / (1 + c^2), and b at most length / 6 |bend| (1 + e)^3 / (1 + c^2), since the step is
/// at most w/3; (1 + e)^3 <= 1 + 4.75 e.
struct BentTest {
  float limit;

  explicit BentTest(const CriterionParameters& criterion) {
    const float over = criterion.excess[0];
    limit = 0.999F * over / (1.0F / 6 + over / 9);
  }
  /// What a second derivative counts beside a slope.
  static float sixth(const PointsOfSlice& points) { return points.length() / 6; }
};

/// A cheap form of the criterion. It is part of the format (section 6.6 of docs/dev/format.md), as it decides
/// which edges the forecast of the activity measures.
///
/// If the step of an end is a third of the chord, its largest value, the spline of criterion.h is the graph
/// of a function. The slope of this function is a quadratic spline of the slopes of the five legs. For small
/// slopes, R / C - 1 is half the variance of that slope, a quadratic form of four numbers, without a square
/// root.
struct VarianceTest {
  float limit;  ///< half of what the criterion allows, in units of the form

  /// `accuracy`: m of the criterion.
  explicit VarianceTest(int accuracy)
      : limit(static_cast<float>(1184.5 / (static_cast<double>(accuracy) * static_cast<double>(accuracy)))) {}

  /// What a second derivative counts beside a slope.
  static float sixth(const PointsOfSlice& points) {
    constexpr float sqrt_over_three[4] = {0, 1.0F / 3, 0.47140452F, 0.57735027F};
    return sqrt_over_three[points.odd] * static_cast<float>(points.unit);
  }
};

/// Edges that were found, each with the number of its point.
struct FoundEdges {
  EdgeBatch edges{};
  std::array<std::uint32_t, EdgeBatch::capacity + EdgeBatch::padding> points{};
  std::size_t count = 0;
};

/// The numbers of points: point (i, j) has the number `first` + 2 unit i + `row` j.
struct PointNumbers {
  std::uint32_t first, row;
};
/// The numbers of bits, counted from the first bit of bits.words(). REQUIRES: there are fewer than 2^32.
inline PointNumbers numbers_of(const PointsOfSlice& points, const LatticeBits& bits) {
  const std::size_t row = 2 * static_cast<std::size_t>(points.unit) * 64 * bits.words_per_row();
  return {static_cast<std::uint32_t>(bits.bit_of({points.x0, points.y0, points.z})),
          static_cast<std::uint32_t>(row)};
}

/// Where a search is, or has ended.
struct EdgePlace {
  std::int64_t column = 0, row = 0;
};

/// The base edges of some points of a slice.
struct EdgesOfSlice {
  const CurvatureField& field;  ///< its points are two units apart
  float rise_scale;             ///< voxels per unit of the field's value component
  PointsOfSlice points;
  PointNumbers numbers;
};

/// Appends the edges that the test finds to `found`, row by row from `from` on, as long as there is room.
/// Returns true if that was all; otherwise it goes on at `from`.
bool find_edges(const EdgesOfSlice& edges, const BentTest& test, EdgePlace& from, FoundEdges& found);
bool find_edges(const EdgesOfSlice& edges, const VarianceTest& test, EdgePlace& from, FoundEdges& found);

}  // namespace tagrid
