#include "stages/grid/diamond.h"

#include <algorithm>
#include <cassert>

namespace tagrid {
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
