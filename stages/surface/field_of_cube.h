// The values at the points where the border of the volume cuts the mesh.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "stages/grid/lattice_bits.h"
#include "stages/values/points/field.h"

namespace tagrid {

/// The piecewise linear field, rounded to samples, at all points of one root cube at a time. Few root cubes
/// need it, so it is computed when the first value of a cube is read. No base edge leaves the closed root
/// cube of its midpoint, so the values are those that the field of the entire brick has.
template <class T>
class FieldOfCube {
 public:
  /// `points` and `active` must outlive the object. See surface_of_brick().
  FieldOfCube(std::span<const T> points, const LatticeBits& active, int cube_size)
      : points_(points), active_(active), cube_size_(cube_size) {}

  static std::uint64_t working_bytes(int cube_size) {
    const Index3 size{cube_size + 1, cube_size + 1, cube_size + 1};
    const auto points = static_cast<std::uint64_t>(size.x * size.y * size.z);
    return points * (2 * sizeof(T) + sizeof(FieldNumber<T>)) + LatticeBits::working_bytes(size);
  }

  void begin(Index3 corner) {
    const Index3 edges{cube_size_, cube_size_, cube_size_};
    cube_ = {corner, corner + edges};
    is_known_ = false;
  }
  /// REQUIRES: begin() was called for a root cube that contains `p`.
  T at(Index3 p) {
    if (!is_known_) compute();
    return field_[static_cast<std::size_t>(cube_.offset(p))];
  }

 private:
  void compute() {
    std::vector<T> values(static_cast<std::size_t>(cube_.count()));
    LatticeBits active(cube_);
    std::size_t i = 0;
    for (std::int64_t z = cube_.low.z; z <= cube_.high.z; ++z)
      for (std::int64_t y = cube_.low.y; y <= cube_.high.y; ++y)
        for (std::int64_t x = cube_.low.x; x <= cube_.high.x; ++x, ++i) {
          if (!active_.test({x, y, z})) continue;
          active.set({x, y, z});
          values[i] = points_[static_cast<std::size_t>(active_.box().offset({x, y, z}))];
        }
    field_ = {};
    const auto field = interpolate_points<T>(values, active, cube_size_);
    field_ = rounded_field<T>(field, values, active, cube_size_);
    is_known_ = true;
  }

  std::span<const T> points_;
  const LatticeBits& active_;
  int cube_size_;
  Box cube_;
  bool is_known_ = false;
  std::vector<T> field_;
};

}  // namespace tagrid
