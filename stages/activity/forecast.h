// Forecasts from its decoded samples which points of a brick are likely to be active.
//
// The forecast is the criterion (criterion.h) in a cheap form without a square root. If the step of an end is
// a third of the chord, its largest value, the spline is the graph of a function. The slope of this function
// is a quadratic spline of the slopes of the five legs. For small slopes, R / C - 1 is half the variance of
// that slope, a quadratic form of four numbers. This form is compared with three multiples of the criterion's
// excess. The points above each are closed under parents, as marks are: this gives a forecast of 0 to 3 for
// every point.
//
// The forecast is part of the format: encoder and decoder both compute it in float32, in a fixed order.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "stages/grid/lattice_bits.h"
#include "stages/volume/coding_parameters.h"

namespace tagrid {

/// A number from 0 to 3 for every point of a box, at least as large as those of the point's children.
class Forecast {
 public:
  static constexpr int levels = 3;

  Forecast() = default;
  /// `exceeding`: the points above each threshold, the lowest threshold first; each set is a subset of the
  /// one before.
  explicit Forecast(const std::array<LatticeBits, levels>& exceeding);

  /// The heap of the forecast for a box of `size` points: a byte for each bit of their LatticeBits.
  static constexpr std::uint64_t working_bytes(Index3 size) { return 8 * LatticeBits::working_bytes(size); }

  /// False: nothing is forecast.
  bool exists() const { return !values_.empty(); }
  /// The forecast of the point that has the bit `bit` in the words of a LatticeBits of the same box.
  std::size_t at(std::size_t bit) const { return values_[bit]; }

 private:
  std::vector<std::uint8_t> values_;
};

/// The forecast for the closed box of a brick from the decoded samples that the brick owns, x fastest. A
/// point beyond them has the value of the nearest of these samples. Safe for any values.
template <class T>
Forecast forecast_activity(std::span<const T> samples, const CodingParameters& parameters, Index3 brick);

/// The peak of the heap that forecast_activity() takes for a closed box of `size` points, including the
/// forecast: the samples of the box and around it, with the heights of wide samples first, and then with the
/// curvature, three sets of bits and the forecast.
std::uint64_t working_bytes_of_forecast(SampleType type, Index3 size);

}  // namespace tagrid
