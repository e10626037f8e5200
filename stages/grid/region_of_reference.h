// The region of reference RR of the paper (Eq. 5): all points on which the activity of a box can depend.
#pragma once

#include "stages/grid/lattice_bits.h"

namespace tagrid {

/// Every lattice point whose mark can affect the activity of a point of `box`. A point is active if it or any
/// of its descendants is marked, so these are the points of the box and all their descendants. The domain
/// counts as unbounded, which gives the largest region for a box of this size.
///
/// The region reaches at most S - 2 points beyond a box of complete root cubes. The paper gives 8 1/3 S^3 for
/// one cube; neighbors at edges and corners take part, too, so the exact count is larger (S = 32: 22.5 S^3).
///
/// Returns the bits of box.grown(cube_size). For a box of complete root cubes this takes some 30 ns per point
/// of the region: use it for planning and tests. REQUIRES: !box.empty(), box.low and box.high are multiples
/// of `cube_size`.
LatticeBits region_of_reference(const Box& box, int cube_size);

}  // namespace tagrid
