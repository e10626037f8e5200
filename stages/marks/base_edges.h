// Base edges, one row at a time, in the form that the criterion needs. The slopes and second derivatives are part
// of the format (section 6.6 of docs/format.md).
#pragma once

#include <cstddef>
#include <cstdint>

#include "stages/grid/box.h"
#include "stages/marks/criterion.h"
#include "stages/marks/curvature.h"

namespace tagrid {

/// The points of one row that have the same class: x = x0 + 2 unit i. Their base edges end at corners of
/// their cells in the lattice of 2 unit.
struct RowOfEdges {
  std::int64_t unit;
  std::int64_t x0, y, z;  ///< first point of the row
  std::int64_t count;
  int odd;  ///< number of coordinates that are odd multiples of the unit: 1, 2, 3
  bool odd_x, odd_y, odd_z;
  bool alternate;  ///< diagonals alternate with the parity of the cell; not at the root

  /// Diagonals that alternate along the row are loaded in two runs: first the cells 0, 2, .., then 1, 3, ..
  int runs() const { return odd_x && odd > 1 ? 2 : 1; }
  Index3 point(std::int64_t cell) const { return {x0 + 2 * unit * cell, y, z}; }
};

/// Loads the edges of the cells [from, from + count) of a row; lanes `first` and after get the cells in the order
/// of the runs. rise_scale: voxels per unit of the field's value component. REQUIRES: first + count
/// <= EdgeBatch::capacity.
void load_edges(const CurvatureField& field, const RowOfEdges& row, std::int64_t from, std::int64_t count,
                float rise_scale, EdgeBatch& edges, std::size_t first = 0);

/// Upper bounds for all edges of a row, in voxels, rounding included: of absolute slopes, of the curve at
/// both ends and of the chord, and of absolute second derivatives. NaN or infinite if an entry of the field
/// is.
struct EdgeBounds {
  float slope, chord, bend;
};
EdgeBounds bounds_of(const CurvatureField& field, const RowOfEdges& row, float rise_scale);

/// Calls f(row) for all rows of points of `box` up to a level: by unit from coarse to fine, then by class.
template <class F>
void for_each_row_of_edges(const Box& box, int cube_size, int max_level, F f) {
  // The first coordinate >= low of the form unit * odd number, or unit * even number.
  const auto first_of = [](std::int64_t low, std::int64_t unit, bool odd) {
    const std::int64_t offset = odd ? unit : 0, period = 2 * unit;
    return offset + (low - offset + period - 1) / period * period;
  };
  int cycle = 0;
  for (std::int64_t unit = cube_size / 2; unit >= 1; unit /= 2, ++cycle)
    for (int bits = 1; bits < 8; ++bits) {
      const bool ox = bits & 1, oy = bits & 2, oz = bits & 4;
      const int odd = int{ox} + int{oy} + int{oz};
      if (3 * cycle + 4 - odd > max_level) continue;
      const std::int64_t x0 = first_of(box.low.x, unit, ox), period = 2 * unit;
      if (x0 > box.high.x) continue;
      const std::int64_t count = (box.high.x - x0) / period + 1;
      for (std::int64_t z = first_of(box.low.z, unit, oz); z <= box.high.z; z += period)
        for (std::int64_t y = first_of(box.low.y, unit, oy); y <= box.high.y; y += period)
          f(RowOfEdges{unit, x0, y, z, count, odd, ox, oy, oz, period != cube_size});
    }
}

}  // namespace tagrid
