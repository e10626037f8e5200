// Base edges, a row at a time, as the criterion wants them.
#pragma once

#include <cstdint>

#include "grid/box.h"
#include "stages/criterion.h"
#include "stages/curvature.h"

namespace tagrid {

/// The points of one row that have the same class: x = x0 + 2 unit i. Their base edges end at corners of
/// their cells in the lattice of 2 unit.
struct RowOfEdges {
  std::int64_t unit;
  std::int64_t x0, y, z;  ///< first point of the row
  std::int64_t count;
  int odd;  ///< how many coordinates are odd multiples of the unit: 1, 2, 3
  bool odd_x, odd_y, odd_z;
  bool alternate;  ///< diagonals alternate with the parity of the cell; not at the root

  /// Diagonals that alternate along the row are loaded in two runs: first the cells 0, 2, .., then 1, 3, ..
  int runs() const { return odd_x && odd > 1 ? 2 : 1; }
  /// The cell that is loaded to `lane` of `count` from cell 0 on.
  std::int64_t cell(std::int64_t lane, std::int64_t lanes) const {
    if (runs() == 1) return lane;
    const std::int64_t first = (lanes + 1) / 2;
    return lane < first ? 2 * lane : 2 * (lane - first) + 1;
  }
  Index3 point(std::int64_t cell) const { return {x0 + 2 * unit * cell, y, z}; }
};

/// Loads the edges of the cells [from, from + count) of a row, cell from + row.cell(lane, count) into each
/// lane. rise_scale: voxels per unit of the field's value component. REQUIRES: count <= EdgeBatch::capacity.
void load_edges(const CurvatureField& field, const RowOfEdges& row, std::int64_t from, std::int64_t count,
                float rise_scale, EdgeBatch& edges);

}  // namespace tagrid
