// Statistics of a brick, or of a volume.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "stages/grid/lattice.h"
#include "stages/sample/thresholds.h"

namespace tagrid {

using Uint128 = unsigned __int128;

struct Statistics {
  /// Number of active points of each level, 0 .. 3K, among the lattice points that the brick owns: (low,
  /// high] of its closed box, including padding; the first brick along an axis also owns the low face.
  std::array<std::uint64_t, max_level(max_cube_size) + 1> active{};
  /// Largest |decoded - original|; infinite if a sample that is not finite was not restored bit by bit.
  double max_error = 0;
  double mesh_error = -1;         ///< largest |field of the mesh - original|; negative: not measured
  Uint128 sum_squared_error = 0;  ///< of integer samples, exactly
  double sum_squared_real = 0;    ///< of finite original floats; at most the largest double
  double low = std::numeric_limits<double>::infinity();  ///< smallest and largest finite original sample
  double high = -std::numeric_limits<double>::infinity();
  double sum = 0;             ///< of the finite original samples
  std::uint64_t finite = 0;   ///< number of finite original samples
  std::uint64_t samples = 0;  ///< number of all samples
  /// For each threshold: the number of samples that are at least it, and of decoded ones that were moved to their side.
  OfThresholds<std::uint64_t> at_least, moved;

  /// Sums never become infinite: they are limited to the largest double.
  static double limited(double v) {
    constexpr double most = std::numeric_limits<double>::max();
    return std::clamp(v, -most, most);
  }

  void add(const Statistics& other) {
    for (std::size_t i = 0; i < active.size(); ++i) active[i] += other.active[i];
    max_error = std::max(max_error, other.max_error);
    mesh_error = std::max(mesh_error, other.mesh_error);
    sum_squared_error += other.sum_squared_error;
    sum_squared_real = limited(sum_squared_real + other.sum_squared_real);
    low = std::min(low, other.low);
    high = std::max(high, other.high);
    sum = limited(sum + other.sum);
    finite += other.finite;
    samples += other.samples;
    at_least.add(other.at_least);
    moved.add(other.moved);
  }
};

/// Measured errors. NaN if a value is unknown or undefined.
struct Achieved {
  double max_error = 0, rmse = 0;
  double psnr = 0;  ///< in dB; the peak is max - min of the original. NaN if nothing was lost.
};

inline Achieved achieved_of(const Statistics& total) {
  Achieved a;
  a.max_error = total.max_error;
  const double squares = static_cast<double>(total.sum_squared_error) + total.sum_squared_real;
  // Samples that are not finite have no error that could be averaged.
  if (total.finite > 0) a.rmse = std::sqrt(squares / static_cast<double>(total.finite));
  const double peak = total.high - total.low;
  // Also undefined if no sample is finite, or all are equal.
  a.psnr = a.rmse > 0 && peak > 0 ? 20 * std::log10(peak / a.rmse) : NAN;
  if (!std::isfinite(a.psnr)) a.psnr = NAN;
  return a;
}

}  // namespace tagrid
