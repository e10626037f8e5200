// The law that keeps a grid free of cracks, checked over an entire structure; and how far it reaches.
#pragma once

#include <optional>

#include "stages/grid/lattice_bits.h"

namespace tagrid {

/// Returns the first point, in raster order, that breaks the law of a conforming grid, or nothing. Such a
/// point is an inactive root corner, or an active point with an inactive parent. Only points in both the box
/// of the bits and `domain` are checked; parents elsewhere are ignored. `domain` consists of complete root
/// cubes and has no negative coordinates.
///
/// EXPENSIVE: some 20 ns per active point. For tests, `verify` and debugging.
std::optional<Index3> first_nonconforming_point(const LatticeBits& active, const Box& domain, int cube_size);

/// True if, within the box of the bits and `domain`, all root corners are active and so are the parents of
/// every active point. EXPENSIVE, as above.
bool is_conforming(const LatticeBits& active, const Box& domain, int cube_size);

/// The region of reference RR of the paper (Eq. 5): every lattice point whose mark can affect the activity of
/// a point of `box`. A point is active if it or any of its descendants is marked, so these are the points of
/// the box and all their descendants. The domain counts as unbounded, which gives the largest region for a
/// box of this size.
///
/// The region reaches at most S - 2 points beyond a box of complete root cubes. The paper gives 8 1/3 S^3 for
/// one cube; neighbors at edges and corners take part, too, so the exact count is larger (S = 32: 22.5 S^3).
///
/// Returns the bits of box.grown(cube_size). For a box of complete root cubes this takes some 30 ns per point
/// of the region: use it for planning and tests. REQUIRES: !box.empty(), box.low and box.high are multiples
/// of `cube_size`.
LatticeBits region_of_reference(const Box& box, int cube_size);

}  // namespace tagrid
