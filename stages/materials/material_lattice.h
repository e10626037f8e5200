// Where the tetrahedra of a mesh with materials may be, before they are cut: cubes with several materials, and their
// neighbors, are bisected at their centers; the closure of the bisection hierarchy makes the rest coarser.
//
// The grid is that of stages/grid, with marks from materials instead of from curvature, so the same closure and the
// same walk over leaves serve both (stages/criterion/subdivide.h, stages/mesh/tetrahedra.h).
#pragma once

#include <cstdint>
#include <vector>

#include "stages/grid/brick_grid.h"
#include "stages/grid/lattice_bits.h"
#include "stages/materials/bcc_lattice.h"
#include "stages/materials/material_field.h"

namespace tagrid {

/// The lattice of a mesh: points from (0, 0, 0) to `last`, in halves of H.
struct MaterialLattice {
  Index3 last;         ///< even, at least 2
  int cube_size = 32;  ///< the edge of root cubes, the coarsest cubes of the mesh: a power of two, at least 4

  Box box() const { return {{0, 0, 0}, last}; }
  /// The root cubes that hold it. Leaves beyond `last` are no part of the mesh.
  Domain domain() const { return {last + Index3{1, 1, 1}, cube_size, 0}; }
  /// The root cubes around a box of root cubes on whose materials its tetrahedra depend.
  Box region(const Box& closed_box) const {
    return intersection(closed_box.grown(std::max<std::int64_t>(cube_size, halo)), domain().padded());
  }
  /// The points around a box of root cubes on whose positions its tetrahedra depend.
  Box surroundings(const Box& closed_box) const { return intersection(closed_box.grown(halo), box()); }

  /// In points; even. A vertex at most 1 point beyond the box depends on tetrahedra around it (2 points), these on
  /// whether their corners are snapped (2), and on neighbors of cubes with several materials (3).
  static constexpr std::int64_t halo = 8;
};

/// The materials of the points in a box.
struct PointMaterials {
  BccBox points;
  std::vector<Material> numbers;  ///< by BccBox::number()

  Material at(Index3 p) const { return numbers[points.number(p)]; }
};

/// REQUIRES: the corners of the box are even; the samples around all its points are there.
PointMaterials materials_of_points(const MaterialField& field, const Box& box);

/// The active points of region(closed_box), from the materials of the points of the region in the lattice. Those in
/// `closed_box`, and the centers of cubes in its surroundings, are the same for every box.
LatticeBits activity_of_materials(const PointMaterials& materials, const MaterialLattice& lattice,
                                  const Box& closed_box);

}  // namespace tagrid
