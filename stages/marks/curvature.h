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
/// points.
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

  Box box;                                                           ///< even corners
  Index3 size;                                                       ///< points per axis, at distance 2
  std::array<std::unique_ptr<float[]>, component_count> components;  ///< size.x * size.y * size.z each

  /// Bounds of the entries of one row: if they are small, the entries need not be read.
  struct RowBounds {
    float lowest, highest;  ///< values
    float slope;            ///< largest length of the gradient: no slope along an edge is larger
    float bend;             ///< largest Frobenius norm of the Hessian: no second derivative is larger
  };
  std::vector<RowBounds> rows;  ///< y fastest; NaN or infinite if an entry is

  /// The peak of the heap that evaluate_curvature() takes for a box of `size` points: the field and the
  /// bounds of its rows, which remain, and six rows of sums.
  static constexpr std::uint64_t working_bytes(Index3 size) {
    const auto half = [](std::int64_t n) { return static_cast<std::uint64_t>(n + 1) / 2; };
    return half(size.y) * half(size.z) *
               (half(size.x) * component_count * sizeof(float) + sizeof(RowBounds)) +
           static_cast<std::uint64_t>(size.x + 2) * 6 * sizeof(double);
  }

  /// Where in a component the row begins whose points have the (even) coordinates y and z; one entry for each
  /// even x.
  std::int64_t row_offset(std::int64_t y, std::int64_t z) const { return row_number(y, z) * size.x; }
  /// Index of that row in `rows`.
  std::int64_t row_number(std::int64_t y, std::int64_t z) const {
    return (z - box.low.z) / 2 * size.y + (y - box.low.y) / 2;
  }
};

/// Evaluates the field on `box` (even corners). REQUIRES: samples.box contains box.grown(halo).
/// field_scale: voxels per unit of field value (in the plane of the paper's curves).
/// T: the narrow sample types; or double, for the heights of wide samples (heights.h), with a scale of 1.
template <class T>
void evaluate_curvature(const Samples<T>& samples, const Box& box, double field_scale, CurvatureField& out);

}  // namespace tagrid
