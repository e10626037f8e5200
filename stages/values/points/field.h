// The piecewise linear field of the grid: the values of all lattice points from those of the active points.
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
#include <vector>

#include "stages/grid/lattice_bits.h"
#include "stages/sample/sample_type.h"

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
/// samples of up to 16 bits), std::int64_t (up to 32 bits), or double. For floats the mean is (left +
/// right) * 0.5, with each operation rounded, which is the same on every machine. If that sum is not finite
/// but both ends are, it is left * 0.5 + right * 0.5; if only one end is finite, it is that end.
///
/// Takes about one or two nanoseconds per point. Any bits are safe; for conforming ones the result is the
/// linear interpolation. REQUIRES: active.box() contains box; box is a closed box of complete root cubes.
template <class Number>
void interpolate(const LatticeBits& active, const Box& box, int cube_size, std::span<Number> values);

/// Rounds interpolated values to samples once, halves up. REQUIRES: equal sizes.
template <class T, class Fixed>
void round_to_samples(std::span<const Fixed> values, int cube_size, std::span<T> samples) {
  assert(values.size() == samples.size());
  const int shift = fractional_bits(cube_size);
  const auto half = static_cast<Fixed>(cube_size / 2);
  for (std::size_t i = 0; i < values.size(); ++i) samples[i] = static_cast<T>((values[i] + half) >> shift);
}

/// The type in which the field of samples of T is computed: exact fixed point for integers, double for
/// floats.
template <class T>
using FieldNumber = std::conditional_t<std::is_floating_point_v<T>, double,
                                       std::conditional_t<is_wide<T>, std::int64_t, std::int32_t>>;

/// Bytes of a FieldNumber for samples of a type.
constexpr std::uint64_t field_number_bytes(SampleType type) {
  return is_float_type(type)  ? sizeof(FieldNumber<double>)
         : is_wide_type(type) ? sizeof(FieldNumber<std::int32_t>)
                              : sizeof(FieldNumber<std::int16_t>);
}

/// The field at all points of `active.box()`, x fastest. `points`: values of the same points, of which those
/// of the active ones are read. REQUIRES: as interpolate().
template <class T>
std::vector<FieldNumber<T>> interpolate_points(std::span<const T> points, const LatticeBits& active,
                                               int cube_size);

/// The same, rounded once to samples: for integers to the nearest, halves up. Active floats keep every bit; a
/// NaN between them has no payload, so that it is the same on every machine.
template <class T>
std::vector<T> rounded_field(std::span<const FieldNumber<T>> field, std::span<const T> points,
                             const LatticeBits& active, int cube_size);

/// The grid without its points of levels above `level`.
LatticeBits prefix_of(const LatticeBits& active, int cube_size, int level);

}  // namespace tagrid
