// Which work is possible, as slices arrive in z order: a state machine without threads.
//
//   slices of a root layer (and the halo above it)   -> mark its tiles
//   marks of a brick layer and one root layer around -> subdivide and encode its bricks
//
// (of the layer above, all but its top face, which decides nothing: see grid/region_of_reference.h)
//
// A tile is the part of a column of bricks in one root layer: every mark is computed once, by the tile that
// owns its point, and kept until the bricks around it are subdivided.
//
// Where only some rows of bricks are encoded, marks of one row of root cubes beyond them are needed too, and
// those are computed again when it is their turn.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "pipeline/encode/slices.h"
#include "stages/grid/brick_rows.h"
#include "stages/grid/lattice_bits.h"
#include "stages/volume/coding_parameters.h"

namespace tagrid {

struct MarkJob {
  Index3 tile;  ///< x, y: of the column of bricks; z: the root layer
  SliceRange slices;
};

struct MarkedTile {
  Index3 tile;
  std::shared_ptr<const LatticeBits> marks;
};

struct BrickJob {
  Index3 brick;
  SliceRange slices;
  std::vector<std::shared_ptr<const LatticeBits>> marks;  ///< of the tiles around, in any order
};

class EncodeSchedule {
 public:
  /// For the bricks of `rows`. `mark_halo`: samples that marks depend on, beyond the root cubes around them.
  EncodeSchedule(const CodingParameters& parameters, const BrickRows& rows, int mark_halo);

  /// The samples that have to be read: slices z = low.z .. high.z, of each the rows low.y .. high.y.
  const Box& samples() const { return samples_; }

  std::vector<MarkJob> add_slice(SliceSamples slice);
  std::vector<BrickJob> add_marks(MarkedTile tile);

  /// The whole root cubes of a tile.
  Box tile_box(Index3 tile) const;
  /// The points whose marks a tile owns: [low, high) of its box, the last tile of an axis also its high face.
  Box mark_box(Index3 tile) const;
  /// Slices that must be in memory at once for every layer to be encoded.
  std::int64_t slices_needed() const;
  /// Slices between two layers of bricks.
  std::int64_t slices_in_layer() const { return std::int64_t{bricks_.edge} * bricks_.domain.cube_size; }
  /// Slices that are no longer needed once this layer of bricks is encoded, but were before.
  std::int64_t slices_released_by(std::int64_t layer) const;

 private:
  std::vector<BrickJob> layers_that_became_ready();
  void add_layer(std::int64_t layer, std::vector<BrickJob>& jobs);
  std::int64_t tile_row_low() const { return std::max<std::int64_t>(rows_.y_low - 1, 0); }
  std::int64_t tile_row_end() const { return std::min(rows_.y_end + 1, bricks_.bricks(1)); }

  BrickGrid bricks_;
  BrickRows rows_;
  std::int64_t halo_;
  bool marks_outside_;  ///< there are marks outside the volume
  Box marked_;          ///< whole root cubes: those of the bricks, and one more on every side
  Box samples_;
  SliceWindow window_;
  std::int64_t root_layer_end_;
  std::int64_t next_root_layer_;   ///< the first whose tiles are not marked or being marked
  std::int64_t next_brick_layer_;  ///< the first that is not being encoded
  struct RootLayer {
    std::int64_t missing = 0;
    std::vector<std::shared_ptr<const LatticeBits>> tiles;
  };
  std::map<std::int64_t, RootLayer> marks_;
};

}  // namespace tagrid
