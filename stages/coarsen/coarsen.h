// The coarsest grid whose mesh is within a bound of all samples.
//
// A set of active points is *closed* if the parents of each are active; its mesh then has no cracks. Let a
// tetrahedron *violate* the bound if a sample in it is further from the linear interpolation of the samples
// at its vertices. A leaf of the mesh of the intersection of two closed sets is a leaf of one of their
// meshes. So among all closed sets whose leaves do not violate the bound, one is contained in all others.
// This is the grid that is computed here.
//
// It is the smallest set with two properties: with a point, it contains its parents; and with a point, it
// contains the midpoint of the base edge of every tetrahedron that its bisection creates and that violates
// the bound. (Root tetrahedra exist from the beginning.) Each rule follows from one point at a time.
// Hence the set is what can be reached from the root tetrahedra, in any order, and each tetrahedron that is
// reached is tested once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "stages/grid/lattice_bits.h"
#include "stages/sample/sample_type.h"

namespace tagrid {

/// A mesh that must be near the samples.
struct MeshBound {
  Box volume;           ///< all samples
  int cube_size = 32;   ///< S
  double largest = 0;   ///< no sample may be further than this from the mesh; at least 0, in units of samples
  bool padded = false;  ///< the mesh is not cut at the border of the volume
};

/// Adds all points to `active` that the bound and the closure require in active.box() because of the points
/// that are active already. Parents outside the box are ignored: who knows their brick must add them there.
///
///   samples    of `type`, at all points of active.box(), x fastest; outside the volume those of the nearest
///              voxel
///   active     of a box of complete root cubes; none at first
///   expanded   the earlier result of this function for `active`, or none: tetrahedra that these points
///              created are not tested again
///
/// Exact for integers. For floats, the test is in doubles, in one order, on the side of safety: a tetrahedron
/// may be bisected whose error is below the bound by less than 2^-47 of its largest value or, where the mesh
/// is cut, by about the precision of the type. A tetrahedron with a vertex or a sample that is not finite
/// violates the bound, unless it holds no sample but its vertices.
///
/// No allocation except a few rows of bits. REQUIRES: bound.largest >= 0; the box is part of the domain.
void refine_to_bound(SampleType type, std::span<const std::byte> samples, const MeshBound& bound,
                     LatticeBits expanded, LatticeBits& active);

/// The peak of the heap that refine_to_bound() takes for a box of `size` points: its copy of `expanded`, and
/// rows.
std::uint64_t working_bytes_of_refining(Index3 size);

}  // namespace tagrid
