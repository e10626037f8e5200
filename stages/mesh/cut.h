// What a tetrahedron and a box have in common: cuts a tetrahedron at the border of the volume, tests whether
// it meets a box, and visits its lattice points in a box.
//
// The intersection of a tetrahedron and the box of the volume is a convex polytope. All its corners are
// lattice points: the planes of the hierarchy's tetrahedra have normals of 0 and +-1 only, so two or three of
// them and the planes of the border meet at integers. The polytope is triangulated by pulling (e.g. Lee and
// Santos, "Subdivisions and triangulations of polytopes", 2017): its lowest corner, in one order of all
// lattice points, is joined to the triangles of the faces that do not contain it, and each face is
// triangulated in the same way. So the triangles of a face depend on the face alone, and two neighbors cut
// their common face in the same way.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "stages/grid/lattice.h"

namespace tagrid {

/// The tetrahedra into which a tetrahedron is cut. A polytope with at most ten faces has at most sixteen
/// corners and 28 triangles, of which at least three contain the lowest corner.
struct Pieces {
  std::array<std::array<Index3, 4>, 25> vertices;  ///< each positive: six_volumes() > 0
  std::size_t count = 0;

  const std::array<Index3, 4>* begin() const { return vertices.data(); }
  const std::array<Index3, 4>* end() const { return vertices.data() + count; }
};

/// True if a vertex lies outside of `volume`, so that the tetrahedron must be cut.
constexpr bool reaches_beyond(const std::array<Index3, 4>& vertices, const Box& volume) {
  for (const Index3& v : vertices)
    if (!volume.contains(v)) return true;
  return false;
}

/// The part of a tetrahedron that lies in the box from the first to the last samples; nothing if that part
/// has no volume. Exact, in integers; takes about a microsecond.
/// REQUIRES: a tetrahedron of the bisection hierarchy, positive or not, with coordinates from 0 on.
Pieces cut_at(const std::array<Index3, 4>& vertices, const Box& volume);

/// True if a tetrahedron and a box have a point in common, in exact integers. Both are closed: the box
/// reaches from sample to sample, and borders are included. A box may be a single sample. The method is
/// separating axes: two convex polytopes are apart if and only if they are apart along a normal of one of
/// their faces, or along a direction that is normal to an edge of each. REQUIRES: the tetrahedron has a
/// volume, its edges are shorter than 2^18; !box.empty().
bool meets(const std::array<Index3, 4>& vertices, const Box& box);

/// The smallest quotient that is not below a / b. REQUIRES: b > 0.
constexpr std::int64_t quotient_rounded_up(std::int64_t a, std::int64_t b) {
  return a / b + (a > 0 && a % b != 0);
}

/// The smallest box that holds the vertices of a tetrahedron.
constexpr Box box_around(const std::array<Index3, 4>& vertices) {
  Box around{vertices[0], vertices[0]};
  for (const Index3& v : vertices)
    for (int axis = 0; axis < 3; ++axis) {
      around.low[axis] = std::min(around.low[axis], v[axis]);
      around.high[axis] = std::max(around.high[axis], v[axis]);
    }
  return around;
}

/// Visits the lattice points of a tetrahedron in `box`, its border included, row by row: visit(p, weights),
/// with their barycentric weights, which are not negative and sum to six_volumes(vertices). Each weight is an
/// affine function of the point, and grows along a row by a constant step. REQUIRES: six_volumes(vertices) >
/// 0.
template <class Visit>
void for_each_point_of(const std::array<Index3, 4>& vertices, const Box& box, Visit visit) {
  const Box around = intersection(box_around(vertices), box);
  const auto weights_at = [&](Index3 p) {
    std::array<std::int64_t, 4> weights;
    for (std::size_t i = 0; i < 4; ++i) {
      auto part = vertices;
      part[i] = p;
      weights[i] = six_volumes(part);
    }
    return weights;
  };
  std::array<std::int64_t, 4> step = weights_at(unit_vector(0));
  const std::array<std::int64_t, 4> origin = weights_at({0, 0, 0});
  for (std::size_t i = 0; i < 4; ++i) step[i] -= origin[i];
  for (std::int64_t z = around.low.z; z <= around.high.z; ++z)
    for (std::int64_t y = around.low.y; y <= around.high.y; ++y) {
      std::array<std::int64_t, 4> weights = weights_at({around.low.x, y, z});
      // The range of steps along the row in which no weight is negative.
      std::int64_t first = 0, last = around.high.x - around.low.x;
      for (std::size_t i = 0; i < 4; ++i) {
        if (step[i] > 0) first = std::max(first, quotient_rounded_up(-weights[i], step[i]));
        if (step[i] < 0) last = std::min(last, weights[i] < 0 ? -1 : weights[i] / -step[i]);
        if (step[i] == 0 && weights[i] < 0) last = -1;
      }
      for (std::size_t i = 0; i < 4; ++i) weights[i] += first * step[i];
      for (std::int64_t x = first; x <= last; ++x) {
        visit(Index3{around.low.x + x, y, z}, weights);
        for (std::size_t i = 0; i < 4; ++i) weights[i] += step[i];
      }
    }
}

}  // namespace tagrid
