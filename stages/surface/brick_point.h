// Points of a brick as single numbers.
#pragma once

#include <cstdint>

#include "stages/grid/box.h"

namespace tagrid {

/// A point of a brick: its number in raster order in the upper half; in the lower half, half of its number in the raster
/// order of the lattice with half the distances. Both are linear in the coordinates. So the sum of two such numbers is that
/// of the points, and half of it is the point in their middle, if that is a lattice point.
using BrickPoint = std::uint64_t;

/// The place of a point among the points of the brick, x fastest.
constexpr std::uint32_t number_of(BrickPoint p) { return static_cast<std::uint32_t>(p >> 32); }

/// The place of the middle of two points in the lattice with half the distances.
constexpr std::uint32_t number_of_middle(BrickPoint a, BrickPoint b) {
  return static_cast<std::uint32_t>(a + b);
}

constexpr Index3 doubled_lattice(Index3 size) { return 2 * size - Index3{1, 1, 1}; }

/// Converts the points of a brick of `size` points, of which there are fewer than 2^28. Points are relative to its low
/// corner.
class BrickPoints {
 public:
  explicit BrickPoints(Index3 size) : size_(size) {
    const Index3 doubled = doubled_lattice(size);
    row_ = joined(size.x, doubled.x);
    slice_ = joined(size.x * size.y, doubled.x * doubled.y);
  }

  BrickPoint point(Index3 p) const {
    return static_cast<BrickPoint>(p.x) * joined(1, 1) + static_cast<BrickPoint>(p.y) * row_ +
           static_cast<BrickPoint>(p.z) * slice_;
  }
  Index3 operator[](BrickPoint p) const {
    const auto number = static_cast<std::int64_t>(number_of(p)), row = number / size_.x;
    return {number % size_.x, row % size_.y, row / size_.y};
  }

 private:
  static constexpr BrickPoint joined(std::int64_t upper, std::int64_t lower) {
    return static_cast<BrickPoint>(upper) << 32 | static_cast<BrickPoint>(lower);
  }

  Index3 size_;
  BrickPoint row_ = 0, slice_ = 0;  // the steps along y and z
};

}  // namespace tagrid
