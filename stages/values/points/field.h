// The piecewise linear field of the grid: computed at every lattice point from the values of the active
// points.
#pragma once

#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "stages/grid/lattice_bits.h"
#include "stages/sample/sample_type.h"

namespace tagrid {

/// The type in which the field of samples of T is computed: exact fixed point for integers (see
/// interpolation.h), double for floats.
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
