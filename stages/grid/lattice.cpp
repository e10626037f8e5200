#include "stages/grid/lattice.h"

#include <algorithm>
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

namespace {

// The part of `v` along one axis.
Index3 along(Index3 v, int axis) { return v[axis] * unit_vector(axis); }

int only_axis(const PointClass& c, bool odd) {
  for (int axis = 0; axis < 3; ++axis)
    if (c.is_odd[static_cast<std::size_t>(axis)] == odd) return axis;
  assert(false);
  return 0;
}

// Eq. 2: the six corners of the cell that the body diagonal does not touch.
PointList ring_of_cube(const BaseEdge& e) {
  const Index3 d = e.right - e.left;
  PointList ring;
  for (int axis = 0; axis < 3; ++axis) {
    const Index3 corner = e.left + along(d, axis);
    ring.push_back(corner);
    ring.push_back(corner + along(d, (axis + 1) % 3));
  }
  return ring;
}

// Eq. 3: the other two corners of the face, and the cube centres on either side of it.
PointList ring_of_face(Index3 p, const PointClass& c, const BaseEdge& e) {
  const int normal = only_axis(c, false);
  const Index3 d = e.right - e.left, up = c.unit * unit_vector(normal);
  PointList ring;
  ring.push_back(e.left + along(d, (normal + 1) % 3));
  ring.push_back(p + up);
  ring.push_back(e.left + along(d, (normal + 2) % 3));
  ring.push_back(p - up);
  return ring;
}

// Eq. 4: face centres and cube centres in turn, in the plane that halves the edge.
PointList ring_of_edge(Index3 p, const PointClass& c) {
  const int axis = only_axis(c, true);
  const Index3 a = c.unit * unit_vector((axis + 1) % 3), b = c.unit * unit_vector((axis + 2) % 3);
  PointList ring;
  for (Index3 step : {a, a + b, b, b - a, -1 * a, -1 * a - b, -1 * b, a - b}) ring.push_back(p + step);
  return ring;
}

}  // namespace

Diamond diamond(Index3 p, const PointClass& c, int cube_size) {
  assert(c.odd > 0);
  Diamond result{base_edge(p, c, cube_size), {}, c.level - 1};
  result.ring = c.odd == 3   ? ring_of_cube(result.edge)
                : c.odd == 2 ? ring_of_face(p, c, result.edge)
                             : ring_of_edge(p, c);
  // The orientation of the ring depends on the octant into which the base edge points; the whole ring has the
  // same orientation.
  if (six_volumes(result.tetrahedron(0).vertices) < 0)
    std::reverse(result.ring.points.begin(), result.ring.points.begin() + result.ring.size);
  return result;
}

}  // namespace tagrid
