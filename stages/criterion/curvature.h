// The field and its derivatives at the ends of base edges.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <type_traits>
#include <vector>

#include "stages/grid/box.h"
#include "stages/sample/samples.h"

namespace tagrid {

/// Value, gradient and Hessian of the field at every second point of a box, or at points that are further
/// apart: base edges of unit u end at points whose coordinates are multiples of 2u. Only a few slices of
/// points are kept: a new one takes the place of the oldest.
///
/// The forecast of the activity is computed from it, so it is part of the format (section 6.6 of
/// docs/dev/format.md).
///
/// The field is the uniform cubic B-spline whose coefficients are the samples: C2, with the 3-point stencils
/// (1,4,1)/6 for the value, (-1,0,1)/2 for the first and (1,-2,1) for the second derivative on each axis.
struct CurvatureField {
  /// Number of samples outside the box that the stencil reads, on every side.
  static constexpr int halo = 1;
  /// The value is kept as an integer, 216 times the field (exact up to 16 bits per sample); derivatives are
  /// in voxels per voxel, and per voxel squared, after multiplication by `field_scale`.
  static constexpr float value_divisor = 216;

  enum Component { value, gx, gy, gz, hxx, hyy, hzz, hxy, hxz, hyz, component_count };

  /// Entries of a component that may be read beyond its last one, as entire vectors are read.
  static constexpr std::size_t padding = 16;

  Box box;                                         ///< corners are multiples of the distance
  std::int64_t distance;                           ///< between points, an even number
  std::int64_t slices;                             ///< that are kept
  Index3 size;                                     ///< points per axis of the box
  std::array<float*, component_count> components;  ///< slices * size.y * size.x each

  CurvatureField(const Box& points, std::int64_t distance_of_points, std::int64_t kept_slices);

  /// The heap of a field.
  static constexpr std::uint64_t working_bytes(Index3 box_size, std::int64_t distance, std::int64_t slices) {
    const auto points = [&](std::int64_t n) { return static_cast<std::uint64_t>((n - 1) / distance + 1); };
    return (points(box_size.x) * points(box_size.y) * static_cast<std::uint64_t>(slices) + padding) *
           component_count * sizeof(float);
  }

  /// Where in a component the row begins whose points have the coordinates y and z. REQUIRES: slice z is
  /// kept.
  std::int64_t row_offset(std::int64_t y, std::int64_t z) const {
    return ((z - box.low.z) / distance % slices * size.y + (y - box.low.y) / distance) * size.x;
  }

 private:
  std::unique_ptr<float[]> all_;
};

/// Evaluates slice z of a field of distance 2. REQUIRES: samples.box contains field.box.grown(halo).
/// field_scale: voxels per unit of field value (in the plane of the paper's curves).
/// T: the narrow sample types; or double, for the heights of wide samples, with a scale of 1.
template <class T>
void evaluate_curvature(const Samples<T>& samples, std::int64_t z, double field_scale, CurvatureField& field);
/// The peak of the heap that it takes for rows of `width` points: six rows of sums.
constexpr std::uint64_t working_bytes_of_evaluating(std::int64_t width) {
  return static_cast<std::uint64_t>(width + 2 * CurvatureField::halo) * 6 * sizeof(double);
}

/// Copies every second point of slice z to a field of the same box with twice the distance. REQUIRES: `to`
/// has a slice z.
void thin_out(const CurvatureField& from, std::int64_t z, CurvatureField& to);

/// (sample - range_low) * field_scale, limited to a million voxels, as a multiple of 2^-20. Such multiples
/// are coarse enough for the stencils of curvature.h to be exact in doubles, and so the same everywhere. A
/// sample that is not finite gives a NaN; edges near it violate nothing.
template <class T>
std::vector<double> heights_of(std::span<const T> samples, double range_low, double field_scale) {
  constexpr double limit = 1 << 20, fine = 1 << 20;
  std::vector<double> heights(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double voxels = (static_cast<double>(samples[i]) - range_low) * field_scale;
    heights[i] = std::floor(std::clamp(voxels, -limit, limit) * fine + 0.5) / fine;
    if constexpr (std::is_floating_point_v<T>)
      if (!std::isfinite(samples[i])) heights[i] = std::numeric_limits<double>::quiet_NaN();
  }
  return heights;
}

}  // namespace tagrid
