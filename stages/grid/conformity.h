// The law that makes a grid free of cracks, as a check of a whole structure.
#pragma once

#include <optional>

#include "stages/grid/lattice_bits.h"

namespace tagrid {

/// The first point, in raster order, that breaks the law of a conforming grid, or nothing: an inactive root
/// corner, or an active point with an inactive parent. Looks at points that are in the box of the bits and in
/// `domain` only; parents elsewhere ask for nothing. `domain` has whole root cubes and
/// no negative coordinates.
///
/// EXPENSIVE: some 20 ns an active point, one by one. For tests, `verify` and debugging.
std::optional<Index3> first_nonconforming_point(const LatticeBits& active, const Box& domain, int cube_size);

/// Whether the set of active points is closed under "parents of an active point are active" and holds all
/// root corners, within the box of the bits and `domain`. EXPENSIVE, as above.
bool is_conforming(const LatticeBits& active, const Box& domain, int cube_size);

}  // namespace tagrid
