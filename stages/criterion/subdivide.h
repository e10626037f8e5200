// Subdivision without cracks: finds the active points from the marks around a brick.
#pragma once

#include <cstdint>
#include <span>

#include "stages/grid/brick_grid.h"
#include "stages/grid/lattice_bits.h"

namespace tagrid {

/// Closes `bits` under "the parents of an active point are active", in place, and activates the root corners.
///
/// The box of the bits must consist of complete root cubes of the lattice; parents outside it are ignored.
/// The function sweeps once over the levels, finest first, and handles entire words of points at a time. The
/// result is what the paper's recursion Neighbor_Require_for_Subdivision decides (its section 2.3), without
/// its repetition.
void close_under_parents(LatticeBits& bits, int cube_size);

/// Closes several sets of the same box, each of which is a subset of the one before. If a set has no points
/// in a row, the sets after it are skipped there.
void close_under_parents(std::span<LatticeBits> nested, int cube_size);

/// The box whose marks affect the activity of the closed box of a brick (the paper's region of reference,
/// rounded up to complete root cubes).
Box region_of_marks(const Box& closed_box, const Domain& domain);

/// The active points of `closed_box`. REQUIRES: marks.box() == region_of_marks(closed_box, domain).
LatticeBits subdivide(LatticeBits marks, const Box& closed_box, const Domain& domain);

/// The peak of the heap that close_under_parents() takes for bits of `size` points: a few rows of bits.
std::uint64_t working_bytes_of_closure(Index3 size);
/// The peak of the heap that subdivide() takes: the marks that it is given, the bits that it returns, and a
/// few rows for copying the pieces of a row.
std::uint64_t working_bytes_of_subdivision(const Box& closed_box, const Domain& domain);

}  // namespace tagrid
