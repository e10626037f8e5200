// Statistics of the samples of a brick, and the check that they keep the bound.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "stages/sample/coding_parameters.h"
#include "stages/sample/numbers.h"
#include "stages/sample/statistics.h"
#include "stages/sample/thresholds.h"
#include "stages/sample/vector_code.h"

namespace tagrid {

/// The error |a - b| for statistics and checks. A sample that is not finite is either right bit by bit, or
/// infinitely wrong.
template <class T>
double sample_error(T a, T b) {
  if constexpr (std::is_integral_v<T>) {
    return static_cast<double>(std::abs(std::int64_t{a} - std::int64_t{b}));
  } else {
    if (identical(a, b)) return 0;
    if (!std::isfinite(a) || !std::isfinite(b)) return std::numeric_limits<double>::infinity();
    return std::fabs(static_cast<double>(a) - static_cast<double>(b));
  }
}

template <class T>
struct IntegerSums {
  using Squares = std::conditional_t<is_wide<T>, Uint128, std::uint64_t>;
  T low = std::numeric_limits<T>::max(), high = std::numeric_limits<T>::lowest();
  std::int64_t sum = 0, worst = 0;
  Squares squares = 0;
};

/// Adds `count` samples. Narrow types add up in 32 bits, which the sum of 32768 such samples cannot exceed.
template <class T>
TAGRID_VECTOR_CODE void add_samples(const T* original, const T* decoded, std::size_t count,
                                    IntegerSums<T>& to) {
  using Sum = std::conditional_t<is_wide<T>, std::int64_t, std::int32_t>;
  using Magnitude = std::make_unsigned_t<Sum>;
  T low = to.low, high = to.high;
  Sum sum = 0, worst = 0;
  auto squares = to.squares;
  for (std::size_t i = 0; i < count; ++i) {
    const Sum difference = Sum{original[i]} - Sum{decoded[i]},
              error = difference < 0 ? -difference : difference;
    low = std::min(low, original[i]);
    high = std::max(high, original[i]);
    sum += original[i];
    worst = std::max(worst, error);
    squares += std::uint64_t{static_cast<Magnitude>(error)} * static_cast<Magnitude>(error);
  }
  to.low = low;
  to.high = high;
  to.sum += sum;
  to.worst = std::max<std::int64_t>(to.worst, worst);
  to.squares = squares;
}

template <class T>
void measure_integers(std::span<const T> original, std::span<const T> decoded, Statistics& brick) {
  constexpr std::size_t chunk = 32768;
  IntegerSums<T> sums;
  for (std::size_t i = 0; i < original.size(); i += chunk)
    add_samples(original.data() + i, decoded.data() + i, std::min(chunk, original.size() - i), sums);
  brick.low = sums.low;
  brick.high = sums.high;
  brick.sum = static_cast<double>(sums.sum);
  brick.finite = original.size();
  brick.max_error = static_cast<double>(sums.worst);
  brick.sum_squared_error = sums.squares;
}

template <class T>
void measure_floats(std::span<const T> original, std::span<const T> decoded, Statistics& brick) {
  for (std::size_t i = 0; i < original.size(); ++i) {
    const auto v = static_cast<double>(original[i]);
    const double error = sample_error(original[i], decoded[i]);
    brick.max_error = std::max(brick.max_error, error);
    if (!std::isfinite(v)) continue;
    brick.sum_squared_real = Statistics::limited(brick.sum_squared_real + error * error);
    brick.low = std::min(brick.low, v);
    brick.high = std::max(brick.high, v);
    brick.sum = Statistics::limited(brick.sum + v);
    ++brick.finite;
  }
}

/// Adds, for each threshold, the number of samples that are at least it.
template <class T>
void count_above(std::span<const T> samples, const Thresholds& thresholds,
                 OfThresholds<std::uint64_t>& counts) {
  counts.count = thresholds.count;
  for (std::size_t i = 0; i < thresholds.count; ++i)
    counts.all[i] += static_cast<std::uint64_t>(
        std::count_if(samples.begin(), samples.end(),
                      [least = static_cast<T>(thresholds.all[i])](T v) { return v >= least; }));
}

/// The same for the bytes of samples of a file's type.
inline void count_above(std::span<const std::byte> samples, const CodingParameters& parameters,
                        OfThresholds<std::uint64_t>& counts) {
  with_sample_type(parameters.type, [&](auto sample) {
    using T = decltype(sample);
    count_above<T>({reinterpret_cast<const T*>(samples.data()), samples.size() / sizeof(T)},
                   parameters.thresholds, counts);
  });
}

/// Adds the errors of the samples of a brick, and the range and sum of the originals. REQUIRES: equal sizes,
/// at least one sample.
template <class T>
void measure_samples(std::span<const T> original, std::span<const T> decoded, const Thresholds& thresholds,
                     Statistics& statistics) {
  Statistics brick;
  count_above(original, thresholds, brick.at_least);
  if constexpr (std::is_integral_v<T>)
    measure_integers(original, decoded, brick);
  else
    measure_floats(original, decoded, brick);
  brick.samples = original.size();
  statistics.add(brick);
}

/// Throws std::logic_error if the errors of decoded samples, or of the mesh, exceed the bounds of
/// the file: the program must end before it writes such a brick. A missing (negative) bound allows
/// every error. With a surface_error, the looser bound is checked, because the statistics do not
/// distinguish active voxels.
inline void check_bound(const Statistics& measured, const CodingParameters& parameters) {
  const double bound = std::max(parameters.max_error, parameters.surface_error);
  // Not ">": NaN breaks every bound.
  if (parameters.max_error >= 0 && !(measured.max_error <= bound))
    throw std::logic_error("a sample was encoded with an error of " + std::to_string(measured.max_error) +
                           ", beyond its bound of " + std::to_string(bound));
  // Negative: not measured yet.
  if (parameters.mesh_error >= 0 && !(measured.mesh_error <= parameters.mesh_error))
    throw std::logic_error("a mesh was encoded with an error of " + std::to_string(measured.mesh_error) +
                           ", beyond its bound of " + std::to_string(parameters.mesh_error));
}

}  // namespace tagrid
