// Checks an entire structure against the law that keeps a grid free of cracks.
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

}  // namespace tagrid
