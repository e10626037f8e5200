// The field and its derivatives at the ends of base edges.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "stages/grid/box.h"
#include "stages/volume/samples.h"

namespace tagrid {

/// Value, gradient and Hessian of the field at every second point of a box; base edges end at no other
/// points. Those with a larger unit end at points that are further apart: see keep_every_second_point().
///
/// The forecast of the activity is computed from it, so it is part of the format (section 6.6 of docs/format.md).
///
/// The field is the uniform cubic B-spline whose coefficients are the samples: C2, with the 3-point stencils
/// (1,4,1)/6 for the value, (-1,0,1)/2 for the first and (1,-2,1) for the second derivative on each axis.
struct CurvatureField {
  /// Number of samples outside the box that the stencil reads, on every side.
  static constexpr int halo = 1;
  /// The value is kept as an integer, 216 times the field (exact up to 16 bits per sample); derivatives are in
  /// voxels per voxel, and per voxel squared, after multiplication by `field_scale`.
  static constexpr float value_divisor = 216;

  enum Component { value, gx, gy, gz, hxx, hyy, hzz, hxy, hxz, hyz, component_count };

  /// Entries of a component that may be read beyond its last one, as vectors are read whole.
  static constexpr std::size_t padding = 16;

  Box box;                                                           ///< even corners
  std::int64_t distance = 2;                                         ///< between points
  Index3 size;                                                       ///< points per axis
  std::array<std::unique_ptr<float[]>, component_count> components;  ///< size.x * size.y * size.z each

  /// The peak of the heap that evaluate_curvature() takes for a box of `size` points: the field, which remains, and six
  /// rows of sums.
  static constexpr std::uint64_t working_bytes(Index3 size) {
    const auto half = [](std::int64_t n) { return static_cast<std::uint64_t>(n + 1) / 2; };
    return (half(size.x) * half(size.y) * half(size.z) + padding) * component_count * sizeof(float) +
           static_cast<std::uint64_t>(size.x + 2) * 6 * sizeof(double);
  }

  /// Where in a component the row begins whose points have the coordinates y and z.
  std::int64_t row_offset(std::int64_t y, std::int64_t z) const {
    return ((z - box.low.z) / distance * size.y + (y - box.low.y) / distance) * size.x;
  }
};

/// Evaluates the field on `box` (even corners). REQUIRES: samples.box contains box.grown(halo).
/// field_scale: voxels per unit of field value (in the plane of the paper's curves).
/// T: the narrow sample types; or double, for the heights of wide samples (heights.h), with a scale of 1.
template <class T>
void evaluate_curvature(const Samples<T>& samples, const Box& box, double field_scale, CurvatureField& out);

/// Doubles the distance between points.
/// REQUIRES: the corners of field.box are multiples of the new distance.
void keep_every_second_point(CurvatureField& field);

}  // namespace tagrid
