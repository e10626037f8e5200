// Binary digits of floats.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "stages/sample/numbers.h"

namespace tagrid {

/// floor(log2 |v|). REQUIRES: v is finite and not zero.
inline int exponent_of(double v) { return std::ilogb(v); }

/// Exponent of the unit in the last place of a number of type T with the magnitude of v.
template <class T>
int last_place(T v) {
  return std::max(exponent_of(static_cast<double>(v)) - (std::numeric_limits<T>::digits - 1),
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

}  // namespace tagrid
