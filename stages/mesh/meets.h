// Tests whether a tetrahedron and a box have a point in common, in exact integers.
#pragma once

#include <array>

#include "stages/grid/tetrahedron.h"

namespace tagrid {

/// Both are closed: the box reaches from sample to sample, and borders are included. A box may be a single
/// sample. The method is separating axes: two convex polytopes are apart if and only if they are apart along
/// a normal of one of their faces, or along a direction that is normal to an edge of each.
/// REQUIRES: the tetrahedron has a volume, its edges are shorter than 2^18; !box.empty().
bool meets(const std::array<Index3, 4>& vertices, const Box& box);

}  // namespace tagrid
