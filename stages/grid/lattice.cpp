#include "stages/grid/lattice.h"

#include <bit>
#include <cassert>

namespace tagrid {
namespace {

int log2_exact(std::int64_t power_of_two) {
  return std::countr_zero(static_cast<std::uint64_t>(power_of_two));
}

}  // namespace

PointClass classify(Index3 p, int cube_size) {
  PointClass c;
  const auto all = static_cast<std::uint64_t>(p.x | p.y | p.z) | static_cast<std::uint64_t>(cube_size);
  c.unit = std::int64_t{1} << std::countr_zero(all);
  if (c.unit == cube_size) return c;
  for (int axis = 0; axis < 3; ++axis) {
    c.is_odd[static_cast<std::size_t>(axis)] = (p[axis] & c.unit) != 0;
    c.odd += c.is_odd[static_cast<std::size_t>(axis)];
  }
  const int cycle = log2_exact(cube_size) - 1 - log2_exact(c.unit);
  c.level = 3 * cycle + (4 - c.odd);
  return c;
}

BaseEdge base_edge(Index3 p, const PointClass& c, int cube_size) {
  assert(c.odd > 0);
  BaseEdge edge{p, p};
  // The first odd axis points from left to right. The others point the same way if the diagonal joins two
  // corners of equal parity on those axes.
  const bool at_root = 2 * c.unit == cube_size;
  bool first = true;
  bool first_left_is_odd_corner = false;
  for (int axis = 0; axis < 3; ++axis) {
    if (!c.is_odd[static_cast<std::size_t>(axis)]) continue;
    const bool low_corner_is_odd = !at_root && ((p[axis] - c.unit) & (2 * c.unit)) != 0;
    if (first) first_left_is_odd_corner = low_corner_is_odd;
    first = false;
    const std::int64_t step = low_corner_is_odd == first_left_is_odd_corner ? c.unit : -c.unit;
    edge.left[axis] -= step;
    edge.right[axis] += step;
  }
  return edge;
}

PointList parents(Index3 p, const PointClass& c, int cube_size) {
  PointList list;
  if (c.odd == 3) {
    if (2 * c.unit == cube_size) return list;
    // `corner` is the corner that the cell shares with its parent cell; the cell lies in direction `step`.
    Index3 corner, step;
    for (int axis = 0; axis < 3; ++axis) {
      const bool low_is_shared = ((p[axis] - c.unit) & (2 * c.unit)) == 0;
      corner[axis] = low_is_shared ? p[axis] - c.unit : p[axis] + c.unit;
      step[axis] = low_is_shared ? 2 * c.unit : -2 * c.unit;
    }
    for (int axis = 0; axis < 3; ++axis) list.push_back(corner + step[axis] * unit_vector(axis));
    return list;
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (c.is_odd[static_cast<std::size_t>(axis)]) continue;
    list.push_back(p - c.unit * unit_vector(axis));
    list.push_back(p + c.unit * unit_vector(axis));
  }
  return list;
}

PointList children(Index3 p, const PointClass& c) {
  PointList list;
  if (c.odd == 1) {
    const std::int64_t half = c.unit / 2;
    if (half == 0) return list;
    for (int octant = 0; octant < 8; ++octant)
      list.push_back(p + half * Index3{octant & 1 ? 1 : -1, octant & 2 ? 1 : -1, octant & 4 ? 1 : -1});
    return list;
  }
  if (c.odd == 0) return list;
  for (int axis = 0; axis < 3; ++axis) {
    if (!c.is_odd[static_cast<std::size_t>(axis)]) continue;
    list.push_back(p - c.unit * unit_vector(axis));
    list.push_back(p + c.unit * unit_vector(axis));
  }
  return list;
}

}  // namespace tagrid
