// Points of a brick as single numbers.
#pragma once

#include <cstdint>

#include "stages/grid/box.h"

namespace tagrid {

/// A point, relative to the low corner of a box, with 21 bits for each coordinate. The sum of two points is the sum of
/// these numbers, and half of it is the point in their middle, if that is a lattice point.
/// REQUIRES: coordinates from 0 to 2^20 - 1.
using PackedPoint = std::uint64_t;

constexpr PackedPoint pack(Index3 p) {
  return static_cast<PackedPoint>(p.x) | static_cast<PackedPoint>(p.y) << 21 |
         static_cast<PackedPoint>(p.z) << 42;
}

constexpr Index3 unpack(PackedPoint p) {
  constexpr PackedPoint mask = (PackedPoint{1} << 21) - 1;
  return {static_cast<std::int64_t>(p & mask), static_cast<std::int64_t>(p >> 21 & mask),
          static_cast<std::int64_t>(p >> 42)};
}

/// Numbers the points of a box from its low corner on, x fastest.
class RasterOrder {
 public:
  explicit RasterOrder(Index3 size)
      : x_(static_cast<std::uint32_t>(size.x)), y_(static_cast<std::uint32_t>(size.y)) {}

  std::uint32_t number(PackedPoint p) const {
    constexpr PackedPoint mask = (PackedPoint{1} << 21) - 1;
    return static_cast<std::uint32_t>(p & mask) +
           x_ * (static_cast<std::uint32_t>(p >> 21 & mask) + y_ * static_cast<std::uint32_t>(p >> 42));
  }

 private:
  std::uint32_t x_, y_;
};

}  // namespace tagrid
