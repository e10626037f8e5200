// The diamond of a lattice point: all tetrahedra that share its base edge (the paper's region of influence
// RI(E), Eqs. 2-4).
#pragma once

#include <array>

#include "stages/grid/lattice.h"
#include "stages/grid/tetrahedron.h"

namespace tagrid {

/// The base edge and the vertices around it, in order. Tetrahedron i has the vertices left, right, ring[i]
/// and ring[i + 1]; the last one closes the ring. There are 6 tetrahedra around a cube centre, 4 around a
/// face centre, and 8 around an edge midpoint. Vertices outside the domain are listed as well.
struct Diamond {
  BaseEdge edge;
  PointList ring;
  int level = 0;  ///< number of bisections that made its tetrahedra: one less than the level of the point

  int size() const { return ring.size; }
  /// REQUIRES: 0 <= i < size().
  Tetrahedron tetrahedron(int i) const {
    return {{edge.left, edge.right, ring[i], ring[i + 1 == ring.size ? 0 : i + 1]}, level};
  }
};

/// The diamond of `p`, with exact integer coordinates. REQUIRES: p is not a root corner.
Diamond diamond(Index3 p, const PointClass& c, int cube_size);

}  // namespace tagrid
