// The region of reference RR of the paper (Eq. 5): what the activity of a box can depend on.
#pragma once

#include "stages/grid/lattice_bits.h"

namespace tagrid {

/// Every lattice point whose mark can decide the activity of a point of `box`: a point is active when it or
/// any of its descendants is marked, so these are the points of the box and all their descendants. The
/// domain is taken as unbounded, which makes it the largest region for a box of this size.
///
/// The region reaches at most S - 2 points out of a box of whole root cubes. The paper states 8 1/3 S^3 for
/// one cube; edge and corner neighbours take part too, so the exact count is larger (S = 32: 22.5 S^3).
///
/// Returns the bits of box.grown(cube_size). A box of whole root cubes costs some 30 ns a point of the
/// region: for planning and tests. REQUIRES: !box.empty(), box.low and box.high are multiples of `cube_size`.
LatticeBits region_of_reference(const Box& box, int cube_size);

}  // namespace tagrid
