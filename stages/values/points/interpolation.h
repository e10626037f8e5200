// Interpolates the values of all lattice points from those of the active points.
//
// An inactive point is the mean of the ends of its base edge, coarse to fine. This is exactly linear
// interpolation in the leaf tetrahedron, as the base edge of an inactive point lies within one leaf.
// Barycentric weights of lattice points are multiples of 1/S, S = 2^K, so K fractional bits hold every mean
// without rounding.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "stages/grid/lattice_bits.h"

namespace tagrid {

/// Number of fractional bits for which interpolation is exact: K for S = 2^K.
constexpr int fractional_bits(int cube_size) {
  int bits = 0;
  for (int s = cube_size; s > 1; s /= 2) ++bits;
  return bits;
}

/// A sample as a fixed-point number with fractional_bits(cube_size) fractional bits.
template <class Fixed, class T>
constexpr Fixed to_fixed(T sample, int cube_size) {
  static_assert(std::is_integral_v<T> && sizeof(Fixed) > sizeof(T));
  return static_cast<Fixed>(sample) * static_cast<Fixed>(cube_size);
}

/// The nearest sample; halves go up (towards +infinity). Means of samples are never outside the range of T.
template <class T, class Fixed>
constexpr T from_fixed(Fixed value, int cube_size) {
  static_assert(std::is_integral_v<T> && sizeof(Fixed) > sizeof(T));
  return static_cast<T>((value + cube_size / 2) >> fractional_bits(cube_size));
}

/// Gives every inactive point of `box` the mean of the ends of its base edge, coarse to fine.
///
/// `values` holds box.count() numbers, x fastest; those of the active points are read, all others are
/// written. Root corners count as active, whatever the bits say. Number is std::int32_t (fixed point, for
/// samples of up to 16 bits), std::int64_t (up to 32 bits), float or double. For floats the mean is (left +
/// right) * 0.5, with each operation rounded, which is the same on every machine. If that sum is not finite
/// but both ends are, it is left * 0.5 + right * 0.5; if only one end is finite, it is that end.
///
/// Takes about one or two nanoseconds per point. Any bits are safe; for conforming ones the result is the
/// linear interpolation. REQUIRES: active.box() contains box; box is a closed box of complete root cubes.
template <class Number>
void interpolate(const LatticeBits& active, const Box& box, int cube_size, std::span<Number> values);

extern template void interpolate<std::int32_t>(const LatticeBits&, const Box&, int, std::span<std::int32_t>);
extern template void interpolate<std::int64_t>(const LatticeBits&, const Box&, int, std::span<std::int64_t>);
extern template void interpolate<float>(const LatticeBits&, const Box&, int, std::span<float>);
extern template void interpolate<double>(const LatticeBits&, const Box&, int, std::span<double>);

/// Rounds interpolated values to samples once, halves up. REQUIRES: equal sizes.
template <class T, class Fixed>
void round_to_samples(std::span<const Fixed> values, int cube_size, std::span<T> samples) {
  assert(values.size() == samples.size());
  const int shift = fractional_bits(cube_size);
  const auto half = static_cast<Fixed>(cube_size / 2);
  for (std::size_t i = 0; i < values.size(); ++i) samples[i] = static_cast<T>((values[i] + half) >> shift);
}

}  // namespace tagrid
