// What a tetrahedron and a box have in common: cuts a tetrahedron at the border of the volume, and tests
// whether it meets a box.
//
// The intersection of a tetrahedron and the box of the volume is a convex polytope. All its corners are
// lattice points: the planes of the hierarchy's tetrahedra have normals of 0 and +-1 only, so two or three of
// them and the planes of the border meet at integers. The polytope is triangulated by pulling (e.g. Lee and
// Santos, "Subdivisions and triangulations of polytopes", 2017): its lowest corner, in one order of all
// lattice points, is joined to the triangles of the faces that do not contain it, and each face is
// triangulated in the same way. So the triangles of a face depend on the face alone, and two neighbors cut
// their common face in the same way.
#pragma once

#include <array>
#include <cstddef>

#include "stages/grid/lattice.h"

namespace tagrid {

/// The tetrahedra into which a tetrahedron is cut. A polytope with at most seven faces has at most ten
/// corners and sixteen triangles, of which at least three contain the lowest corner.
struct Pieces {
  std::array<std::array<Index3, 4>, 13> vertices;  ///< each positive: six_volumes() > 0
  std::size_t count = 0;

  const std::array<Index3, 4>* begin() const { return vertices.data(); }
  const std::array<Index3, 4>* end() const { return vertices.data() + count; }
};

/// True if a vertex lies above `last` on some axis, so that the tetrahedron must be cut.
constexpr bool reaches_beyond(const std::array<Index3, 4>& vertices, Index3 last) {
  for (const Index3& v : vertices)
    if (v.x > last.x || v.y > last.y || v.z > last.z) return true;
  return false;
}

/// The part of a tetrahedron that lies in the box up to `last` on all axes; nothing if that part has no
/// volume. Exact, in integers; takes about a microsecond.
/// REQUIRES: a tetrahedron of the bisection hierarchy, positive or not, with coordinates from 0 on.
Pieces cut_at(const std::array<Index3, 4>& vertices, Index3 last);

/// True if a tetrahedron and a box have a point in common, in exact integers. Both are closed: the box
/// reaches from sample to sample, and borders are included. A box may be a single sample. The method is
/// separating axes: two convex polytopes are apart if and only if they are apart along a normal of one of
/// their faces, or along a direction that is normal to an edge of each. REQUIRES: the tetrahedron has a
/// volume, its edges are shorter than 2^18; !box.empty().
bool meets(const std::array<Index3, 4>& vertices, const Box& box);

}  // namespace tagrid
