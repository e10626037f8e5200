// The second criterion: a bound on the piecewise linear field of the mesh.
//
// A point is marked if a sample inside a tetrahedron of its diamond is further than a bound from the linear
// interpolation of the original values at the vertices of that tetrahedron. A leaf is a tetrahedron of the
// diamond of an inactive point, so after the closure no leaf violates the bound.
#pragma once

#include <cstdint>

#include "stages/grid/brick_grid.h"
#include "stages/grid/lattice_bits.h"
#include "stages/sample/coding_parameters.h"
#include "stages/sample/samples.h"

namespace tagrid {

/// Number of samples read around the marked points, on every side: half the edge of the largest diamond.
constexpr int mesh_criterion_halo(int cube_size) { return cube_size / 2; }

/// The peak of the heap that mark_mesh_error() takes for marks of a box of `size` points: the bound of the
/// error at each point, and the vertices of one diamond.
constexpr std::uint64_t working_bytes_of_mesh_criterion(Index3 size) {
  return static_cast<std::uint64_t>(size.x * size.y * size.z) * sizeof(std::int64_t) + 1024;
}

/// The largest allowed distance of a sample from the interpolation of the original values; a multiple of 1/2
/// for integers.
struct MeshBounds {
  MeshBounds(double all) : inner(all), border(all) {}
  MeshBounds(double in, double at_border, double of_values)
      : inner(in), border(at_border), value_error(of_values) {}

  double inner;            ///< in tetrahedra inside the volume
  double border;           ///< in tetrahedra that its border cuts; negative: none may be cut
  double value_error = 0;  ///< how far decoded values may be from the original ones
};

/// The bounds that the criterion must keep, so that the mesh of the decoded values keeps its bound (M), and a
/// file without voxels keeps that of its voxels; see docs/dev/decisions/0019-mesh-error.md. REQUIRES:
/// parameters.bounds_interpolation().
MeshBounds mesh_bounds(const CodingParameters& parameters);

/// Marks the points of `marks.box()` that violate the bounds, including points outside the volume. Points
/// that are already marked stay marked. If a descendant is marked, a point that violates the bound may stay
/// unmarked, and one that does not may be marked: the closure of the marks is the same. REQUIRES: samples.box
/// contains marks.box() grown by the halo; a point outside the volume has the value of the nearest sample.
///
/// Floats: a tetrahedron with a vertex or a sample that is not finite violates the bound, unless it holds no
/// sample but its vertices. The bound is reduced by the largest rounding error of an interpolation that is
/// rounded at every step, and to T at the end. If all samples and vertices are equal, nothing is rounded.
template <class T>
void mark_mesh_error(const Samples<T>& samples, const Domain& domain, const MeshBounds& bounds,
                     LatticeBits& marks);

/// The largest difference between the interpolation and a sample of the volume inside the diamond of `p`,
/// times 2u, where u is the unit of p. It stops early, with any larger value, once it is above `enough`. For
/// integer samples.
template <class T>
std::int64_t diamond_error(const Samples<T>& samples, const Domain& domain, Index3 p, std::int64_t enough);

}  // namespace tagrid
