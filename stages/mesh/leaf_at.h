// The leaf tetrahedron at a place, found by descending the bisection hierarchy.
#pragma once

#include <cstdint>

#include "stages/grid/lattice_bits.h"
#include "stages/mesh/tetrahedra.h"

namespace tagrid {

/// A place in the lattice, whose coordinates may be fractions: numerators / parts.
struct Place {
  Index3 numerators;
  std::int64_t parts = 1;
};

/// A leaf tetrahedron that contains `place`, its border included. Any bits are safe; the leaf is one of
/// for_each_leaf_tetrahedron(). If the place is on a common border of several leaves, the same one is always
/// found in the same box.
///
/// Exact: the barycentric coordinates of the place are integers at every level. REQUIRES: active.box()
/// consists of complete root cubes and contains the place; coordinates >= 0; parts >= 1; parts * coordinate <
/// 2^62.
BisectionStep leaf_at(const LatticeBits& active, const Place& place, int cube_size);

}  // namespace tagrid
