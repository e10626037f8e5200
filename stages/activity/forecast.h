// Forecasts from its decoded samples which points of a brick are likely to be active.
//
// The forecast is the criterion (stages/criterion/criterion.h), evaluated on the decoded samples, with three
// thresholds: 0.6, 1 and 1.6 times the excess that it allows, for those edges that a cheaper test
// (stages/criterion/find_edges.h) does not rule out. The points above each threshold are closed under
// parents, as marks are: this gives a forecast of 0 to 3 for every point. In a lossless file without a bound
// on the mesh, the second set is nearly the activity, except points whose marks depend on samples that the
// brick does not own.
//
// The forecast is part of the format: encoder and decoder both compute it in float32, in a fixed order.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>

#include "stages/grid/lattice_bits.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {

/// A number from 0 to 3 for every point of a box, at least as large as those of the point's children.
class Forecast {
 public:
  static constexpr int levels = 3;

  Forecast() = default;
  /// `sets`: the points with a forecast of at least 1, 2, and 3; each set is a subset of the one before, and
  /// they are sets of one box.
  explicit Forecast(std::array<LatticeBits, levels> sets) : sets_(std::move(sets)) {}

  /// The heap of the forecast for a box of `size` points.
  static constexpr std::uint64_t working_bytes(Index3 size) {
    return levels * LatticeBits::working_bytes(size);
  }

  /// False: nothing is forecast.
  bool exists() const { return !sets_[0].box().empty(); }
  /// The points with a forecast of at least `level`: 1, 2, or 3.
  const LatticeBits& at_least(int level) const { return sets_[static_cast<std::size_t>(level - 1)]; }

 private:
  std::array<LatticeBits, levels> sets_;
};

/// The forecast for the closed box of a brick from the decoded samples that the brick owns, x fastest. A
/// point beyond them has the value of the nearest of these samples. Safe for any values.
template <class T>
Forecast forecast_activity(std::span<const T> samples, const CodingParameters& parameters, Index3 brick);

/// The peak of the heap that forecast_activity() takes for a closed box of `size` points, including the
/// forecast: the samples of the box and around it, with the heights of wide samples first, and then with the
/// curvature, three sets of bits and what closing them takes.
std::uint64_t working_bytes_of_forecast(SampleType type, Index3 size, int cube_size);

}  // namespace tagrid
