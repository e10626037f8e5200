// Base edges, by the points in their middles.
#pragma once

#include <cstdint>

#include "stages/grid/box.h"
#include "stages/grid/lattice.h"

namespace tagrid {

/// The points of one class in one slice: x = x0 + 2 unit i, y = y0 + 2 unit j. Their base edges end at
/// corners of their cells in the lattice of 2 unit.
struct PointsOfSlice {
  std::int64_t unit;
  std::int64_t x0, y0, z;      ///< the first point
  std::int64_t columns, rows;  ///< number of i, and of j
  int odd;                     ///< number of coordinates that are odd multiples of the unit: 1, 2, 3
  bool odd_x, odd_y, odd_z;
  bool alternate;  ///< diagonals alternate with the parity of the cell; not at the root

  /// One for each edge.
  float length() const {
    constexpr float sqrt_of[4] = {0, 1, 1.41421356F, 1.73205081F};
    return static_cast<float>(2 * unit) * sqrt_of[odd];
  }
};

/// The direction of an edge: the distance in units along each axis from its middle to its right end. An edge
/// rises along its first odd axis.
struct Way {
  std::int64_t x, y, z;
};

/// The direction of the edge of point (i, j); it depends only on whether these are even.
inline Way way_of(const PointsOfSlice& points, std::int64_t i, std::int64_t j) {
  // Along the other axes an edge rises if its cell has the same parity there as along the first. The low
  // corner of a cell is a unit below its middle.
  const std::int64_t u = points.unit;
  const auto parity = [&](bool odd, std::int64_t middle) {
    return odd && points.alternate && ((middle - u) & (2 * u)) != 0;
  };
  const bool px = parity(points.odd_x, points.x0 + 2 * u * i),
             py = parity(points.odd_y, points.y0 + 2 * u * j), pz = parity(points.odd_z, points.z);
  const bool first = points.odd_x ? px : points.odd_y ? py : pz;
  const auto along = [first](bool odd, bool p) { return !odd ? 0 : p == first ? 1 : -1; };
  return {along(points.odd_x, px), along(points.odd_y, py), along(points.odd_z, pz)};
}

/// The first coordinate from `low` on that is an odd, or an even, multiple of the unit.
constexpr std::int64_t first_multiple(std::int64_t low, std::int64_t unit, bool odd) {
  const std::int64_t offset = odd ? unit : 0, period = 2 * unit;
  return offset + (low - offset + period - 1) / period * period;
}

/// Calls f(points) for each class of points with this unit in slice z of `box`, up to a level. REQUIRES: z is
/// a multiple of the unit.
template <class F>
void for_each_class_of_points(const Box& box, int cube_size, int max_level, std::int64_t unit, std::int64_t z,
                              F f) {
  if (z < box.low.z || z > box.high.z) return;
  const std::int64_t period = 2 * unit;
  const auto count = [&](std::int64_t first, std::int64_t high) {
    return first > high ? 0 : (high - first) / period + 1;
  };
  for (int bits = 0; bits < 4; ++bits) {
    const bool ox = bits & 1, oy = bits & 2, oz = (z & unit) != 0;
    const int odd = int{ox} + int{oy} + int{oz};
    if (odd == 0 || level_of(cube_size, unit, odd) > max_level) continue;
    const std::int64_t x0 = first_multiple(box.low.x, unit, ox), y0 = first_multiple(box.low.y, unit, oy);
    const PointsOfSlice points{unit, x0, y0, z,  count(x0, box.high.x), count(y0, box.high.y),
                               odd,  ox, oy, oz, period != cube_size};
    if (points.columns > 0 && points.rows > 0) f(points);
  }
}

}  // namespace tagrid
