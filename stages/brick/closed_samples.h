// Decoded samples of the closed boxes of bricks. A brick does not own the samples on its low faces; they come
// from the bricks before it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "stages/grid/brick_grid.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {

/// The rows of bricks that own the samples on the low faces of `rows`, in raster order. They have to be
/// decoded first, for this purpose only. No stretch has more rows than `rows`.
std::vector<BrickRows> rows_below(const BrickRows& rows);

/// True if the values of the mesh on the low faces of a brick depend on how the bricks below are coded. In a
/// lossless file they do not, because they are the samples themselves. In a grid-only file they do not
/// either, because both bricks store them.
inline bool mesh_needs_bricks_below(const CodingParameters& parameters) {
  return parameters.mesh_error >= 0 && parameters.mesh_has_coded_values();
}

/// Completes bricks, one at a time. Only a staircase of high faces is kept for later bricks; see IdPlanes.
/// Memory: the samples of one slice of the rows, and of two faces between bricks.
class ClosedSamples {
 public:
  /// Completes the bricks of `rows`, and the bricks below them.
  ClosedSamples(const CodingParameters& parameters, const BrickRows& rows);

  /// The heap that this takes for a number of rows of bricks of one layer.
  static std::uint64_t working_bytes(const CodingParameters& parameters, std::int64_t rows);

  /// The samples of the closed box of a brick, x fastest; a point outside the volume has the value of the
  /// nearest sample. `owned` are those that the brick owns. REQUIRES: bricks come in the order of their
  /// numbers, those of rows_below() first. For the bricks of rows_below(), the result is not complete.
  std::vector<std::byte> complete(Index3 position, const std::vector<std::byte>& owned);

 private:
  std::size_t face_offset(int axis, const Box& box, Index3 p) const;

  BrickGrid bricks_;
  std::size_t size_;                 ///< of a sample
  Box volume_;                       ///< all samples
  std::int64_t y_first_, row_;       ///< the first y of all rows; samples along x
  std::vector<std::byte> faces_[3];  ///< high faces of the bricks before, by axis
};

}  // namespace tagrid
