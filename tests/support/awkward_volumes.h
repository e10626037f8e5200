// Volumes that are hard on a coder, of every sample type.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <type_traits>
#include <vector>

#include "stages/grid/box.h"
#include "tests/support/points.h"

namespace tagrid {

enum class Awkward {
  constant,
  constant_extreme,
  smooth,
  smooth_fine,
  noise,
  any_bits,
  alternating_extremes,
  edge_of_overflow,
  signed_zeros,
  denormals,
  not_finite_blobs,
  nan_payloads,
  fill_value,
  sparse,
  count
};

inline std::string name_of(Awkward kind) {
  static const char* const names[] = {
      "constant",         "constant extreme", "smooth",     "smooth fine", "noise",
      "any bits",         "alternating",      "overflow",   "zeros",       "denormals",
      "not finite blobs", "NaN payloads",     "fill value", "sparse"};
  return names[static_cast<std::size_t>(kind)];
}

/// For integer types, kinds that only floats have are replaced by similar ones.
template <class T>
std::vector<T> awkward_volume(Awkward kind, Index3 dims, unsigned seed) {
  using Limits = std::numeric_limits<T>;
  std::mt19937_64 random(seed);
  const auto part = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  const auto any_bits = [&] {
    T v;
    const std::uint64_t bits = random();
    std::memcpy(&v, &bits, sizeof v);
    return v;
  };
  const double phase = 6 * part();
  std::vector<T> out;
  for (const auto [x, y, z] : points_of(dims)) {
    const double wave = std::sin(0.4 * static_cast<double>(x) + phase) +
                        std::cos(0.3 * static_cast<double>(y) - 0.2 * static_cast<double>(z));
    const auto smooth = static_cast<T>(50 + 20 * wave);
    const bool blob = (x / 3 + y / 2 + z / 3) % 4 == 1;
    T v = smooth;
    switch (kind) {
      case Awkward::constant:
        v = static_cast<T>(37);
        break;
      case Awkward::constant_extreme:
        v = Limits::lowest();
        break;
      case Awkward::smooth_fine:
        v = std::is_integral_v<T> ? static_cast<T>(Limits::max() / 8 * (wave + 3))
                                  : static_cast<T>(wave * 1e-6);
        break;
      case Awkward::noise:
        v = static_cast<T>(part() * 100);
        break;
      case Awkward::any_bits:
        v = any_bits();
        break;
      case Awkward::alternating_extremes:
        v = (x + y + z) % 2 ? Limits::max() : Limits::lowest();
        break;
      case Awkward::edge_of_overflow:
        if constexpr (std::is_integral_v<T>)
          v = static_cast<T>(Limits::max() - static_cast<T>(random() % 5));
        else
          v = static_cast<T>(Limits::max() * (random() % 3 ? 1 - 1e-6 * part() : 0.4));
        break;
      case Awkward::signed_zeros:
        v = static_cast<T>(random() % 4 == 0 ? 1 : 0);
        if (random() % 2) v = static_cast<T>(-v);
        break;
      case Awkward::denormals:
        if constexpr (std::is_floating_point_v<T>)
          v = static_cast<T>(Limits::denorm_min() * static_cast<T>(random() % 9)) * (random() % 2 ? 1 : -1);
        break;
      case Awkward::not_finite_blobs:
        if constexpr (std::is_floating_point_v<T>)
          if (blob) v = y % 2 ? Limits::infinity() : x % 2 ? -Limits::infinity() : Limits::quiet_NaN();
        break;
      case Awkward::nan_payloads:
        if constexpr (std::is_floating_point_v<T>) {
          using Bits = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;
          const auto exponent = std::bit_cast<Bits>(Limits::infinity());
          v = std::bit_cast<T>(
              static_cast<Bits>(exponent | (random() % 5 + 1) | (random() % 2 << (8 * sizeof(T) - 1))));
        }
        break;
      case Awkward::fill_value:
        if (blob) v = Limits::lowest();
        break;
      case Awkward::sparse:
        v = random() % 50 ? T{} : any_bits();
        break;
      default:
        break;
    }
    out.push_back(v);
  }
  return out;
}

/// True if b is within `bound` of a. If one of them is not finite, or the bound is 0, they must be equal bit
/// by bit.
template <class T>
bool comes_back(T a, T b, double bound) {
  if (std::memcmp(&a, &b, sizeof a) == 0) return true;
  if constexpr (std::is_integral_v<T>) {
    return static_cast<double>(std::abs(std::int64_t{a} - std::int64_t{b})) <= bound;
  } else {
    if (bound == 0 || !std::isfinite(a) || !std::isfinite(b)) return false;
    return std::fabs(static_cast<long double>(a) - static_cast<long double>(b)) <= bound;
  }
}

}  // namespace tagrid
