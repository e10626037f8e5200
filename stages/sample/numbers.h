// Samples of 32 bits, and floats, as integers: the coders of the wide types work on these.
//
// An integer sample is its own number. A float has two forms: its key, an integer in the order of the values,
// which loses nothing; or a fixed-point number, a multiple of a power of two.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>
#include <vector>

#include "stages/sample/sample_type.h"

namespace tagrid {

using Int128 = __int128;

template <class T>
using BitsOf = std::conditional_t<sizeof(T) == 8, std::uint64_t, std::uint32_t>;

/// The bits of a sample.
template <class T>
constexpr BitsOf<T> bits_of(T value) {
  return std::bit_cast<BitsOf<T>>(value);
}

/// True if two samples are equal bit by bit: zeros differ by their sign, and a NaN equals itself.
template <class T>
constexpr bool identical(T a, T b) {
  if constexpr (std::is_integral_v<T>) return a == b;
  if constexpr (std::is_floating_point_v<T>) return bits_of(a) == bits_of(b);
}

template <class T>
bool is_finite(T value) {
  if constexpr (std::is_floating_point_v<T>) return std::isfinite(value);
  if constexpr (std::is_integral_v<T>) return value == value;
}

/// The key of a float: its bits as a two's complement number, with the magnitude inverted if it is negative.
/// Keys are in the order of the values; -0 has the key -1, and +0 has 0. An integer is its own key.
template <class T>
constexpr std::int64_t key_of(T value) {
  if constexpr (std::is_integral_v<T>) {
    return value;
  } else {
    using Signed = std::make_signed_t<BitsOf<T>>;
    const auto bits = static_cast<Signed>(bits_of(value));
    return bits < 0 ? bits ^ std::numeric_limits<Signed>::max() : bits;
  }
}

/// The inverse of the above. REQUIRES: `key` is the key of a value of T.
template <class T>
constexpr T from_key(std::int64_t key) {
  if constexpr (std::is_integral_v<T>) {
    return static_cast<T>(key);
  } else {
    using Signed = std::make_signed_t<BitsOf<T>>;
    const auto folded = static_cast<Signed>(key);
    return std::bit_cast<T>(folded < 0 ? folded ^ std::numeric_limits<Signed>::max() : folded);
  }
}

/// The largest magnitude of a fixed-point number, so that sums of weighted ones fit into 64 bits.
inline constexpr std::int64_t largest_fixed = std::int64_t{1} << 46;
/// Range of the exponent of the unit of fixed-point numbers: products with the unit are exact.
inline constexpr int lowest_exponent = -1000, highest_exponent = 960;

/// 2^exponent. REQUIRES: -1022 <= exponent <= 1023.
inline double power_of_two(int exponent) {
  return std::bit_cast<double>(static_cast<std::uint64_t>(exponent + 1023) << 52);
}

/// The sample for which a fixed-point number stands: number * 2^exponent, rounded to T once.
template <class T>
T from_fixed_point(std::int64_t number, double unit) {
  return static_cast<T>(static_cast<double>(number) * unit);
}

/// True if |a - b| <= bound, exactly: the rounding of the difference never lets a larger one pass.
inline bool within(double a, double b, double bound) {
  const double difference = a - b;
  const double distance = std::fabs(difference);
  if (!(distance <= bound)) return false;
  if (distance < bound) return true;
  // The rounding error of a - b (Knuth's TwoSum).
  const double minus_b = difference - a, rest = (a - (difference - minus_b)) - (b + minus_b);
  return difference < 0 ? rest >= 0 : rest <= 0;
}

/// Exponent of the unit in the last place of a number of type T with the magnitude of v.
template <class T>
int last_place(T v) {
  return std::max(std::ilogb(static_cast<double>(v)) - (std::numeric_limits<T>::digits - 1),
                  std::numeric_limits<T>::min_exponent - std::numeric_limits<T>::digits);
}

/// Exponent of the lowest binary digit of a float.
template <class T>
int lowest_digit(T v) {
  const int mantissa_bits = std::numeric_limits<T>::digits - 1;
  const BitsOf<T> mantissa = bits_of(v) & ((BitsOf<T>{1} << mantissa_bits) - 1);
  const bool normal = std::fabs(v) >= std::numeric_limits<T>::min();
  return last_place(v) + std::min(std::countr_zero(mantissa), normal ? mantissa_bits : 64);
}

// Numbers as bytes of coded values, the lowest byte first.

/// Appends the lower bytes of a number, the lowest first.
inline void append_bytes(std::uint64_t number, std::size_t count, std::vector<std::uint8_t>& out) {
  for (std::size_t byte = 0; byte < count; ++byte)
    out.push_back(static_cast<std::uint8_t>(number >> (8 * byte)));
}
/// The inverse, for up to eight bytes.
inline std::uint64_t number_in(std::span<const std::uint8_t> bytes) {
  std::uint64_t number = 0;
  for (std::size_t byte = 0; byte < bytes.size(); ++byte) number |= std::uint64_t{bytes[byte]} << (8 * byte);
  return number;
}

}  // namespace tagrid
