// Finds out which work on a grid is possible as slices arrive in z order: a state machine without threads.
//
//   slices of a root layer (and the halo above it)   -> mark its tiles
//   marks of a brick layer and one root layer around -> subdivide and encode its bricks
//
// (The top face of the layer above is not needed: no brick depends on it; see grid/region_of_reference.h)
//
// A tile is the part of a column of bricks in one root layer: every mark is computed once, by the tile that
// owns its point, and kept until the bricks around it are subdivided.
//
// If only some rows of bricks are encoded, marks of one row of root cubes beyond them are needed, too. They
// are computed again for the rows that own them.
//
// Bricks without a grid need no marks: they are ready when the slices of their layer have arrived.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "pipeline/grid/slices.h"
#include "stages/grid/brick_grid.h"
#include "stages/grid/lattice_bits.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {

struct MarkJob {
  Index3 tile;  ///< x, y: the column of bricks; z: the root layer
  SliceRange slices;
};

struct MarkedTile {
  Index3 tile;
  std::shared_ptr<const LatticeBits> marks;
};

struct BrickJob {
  Index3 brick;
  SliceRange slices;
  std::vector<std::shared_ptr<const LatticeBits>> marks;  ///< of the surrounding tiles, in any order
};

class GridSchedule {
 public:
  /// For the bricks of `rows`. `mark_halo`: the samples beyond root cubes that marks need; empty: no marks.
  GridSchedule(const CodingParameters& parameters, const BrickRows& rows, std::optional<int> mark_halo);

  /// The samples that must be read, as points of the lattice: slices z = low.z .. high.z, and of each slice the rows low.y .. high.y.
  const Box& samples() const { return samples_; }

  /// What has become possible.
  struct Work {
    std::vector<MarkJob> tiles;
    std::vector<BrickJob> bricks;
  };
  Work add_slice(SliceSamples slice);
  Work add_marks(MarkedTile tile);

  /// The complete root cubes of a tile.
  Box tile_box(Index3 tile) const;
  /// The points whose marks a tile owns: [low, high) of its box, at the end of an axis also the high face.
  Box mark_box(Index3 tile) const;
  /// Number of slices that must be in memory at once so that every layer can be encoded.
  std::int64_t slices_needed() const;
  /// Number of slices from one layer of bricks to the next.
  std::int64_t slices_in_layer() const { return bricks_.length(); }
  /// Number of slices that are no longer needed after this layer of bricks has been encoded.
  std::int64_t slices_released_by(std::int64_t layer) const;

  /// The most memory of slices, marks, and jobs that wait for a thread, for `rows` rows of bricks of one layer, or of
  /// all layers if these are all rows. `slices_ahead`: slices besides those that slices_needed() counts. A double,
  /// because the header of a damaged file may claim more than 2^64 bytes.
  static double memory(const CodingParameters& parameters, std::int64_t rows, std::optional<int> mark_halo,
                       std::int64_t slices_ahead);

 private:
  std::vector<MarkJob> tiles_that_became_ready();
  std::vector<BrickJob> layers_that_became_ready();
  bool has_marks(std::int64_t layer) const;
  void add_layer(std::int64_t layer, std::vector<BrickJob>& jobs);
  std::int64_t tile_row_low() const { return std::max<std::int64_t>(rows_.y_low - 1, 0); }
  std::int64_t tile_row_end() const { return std::min(rows_.y_end + 1, bricks_.bricks(1)); }

  BrickGrid bricks_;
  BrickRows rows_;
  bool marks_;  ///< whether there are any
  std::int64_t halo_;
  bool marks_outside_;  ///< whether points outside the volume are marked
  Box marked_;          ///< complete root cubes: those of the bricks and, for marks, one more on every side
  Box samples_;
  SliceWindow window_;
  std::int64_t root_layer_end_;
  std::int64_t next_root_layer_;   ///< the first root layer whose tiles are not marked or being marked
  std::int64_t next_brick_layer_;  ///< the first layer of bricks that is not being encoded
  struct RootLayer {
    std::int64_t missing = 0;
    std::vector<std::shared_ptr<const LatticeBits>> tiles;
  };
  std::map<std::int64_t, RootLayer> root_layers_;
};

struct SubdividedBrick {
  Index3 brick;
  SliceRange slices;
  LatticeBits active;
};

MarkedTile mark(const MarkJob& job, const CodingParameters& parameters, const GridSchedule& schedule);
/// Without marks around the brick: no grid, and an empty activity.
SubdividedBrick subdivide(const BrickJob& job, const CodingParameters& parameters);
/// The most memory of the activity of a brick that is handed on, with its object and what shares it.
double memory_of_activity(const CodingParameters& parameters);
/// The most memory that a thread takes for these two, with the samples and marks that they gather.
double memory_of_marking(const CodingParameters& parameters);
double memory_of_subdividing(const CodingParameters& parameters);

/// Computes the activity of bricks from slices, which come in the order of z. Marks and bricks are computed
/// on the threads of the arena that adds the slices; the result does not depend on their number.
class DerivedGrid {
 public:
  /// Takes the bricks one at a time, in order. `slices` hold the closed box within the volume.
  using Take = std::function<void(const SubdividedBrick& brick)>;

  /// For the bricks of `rows`. `parameters` must outlive the object.
  DerivedGrid(const CodingParameters& parameters, const BrickRows& rows, Take take);

  /// The samples that must be added: slices low.z .. high.z, and of each slice the rows low.y .. high.y.
  const Box& samples() const { return schedule_.samples(); }
  /// The stretches of rows of bricks that own these samples, in the order in which samples must come.
  std::vector<BrickRows> stretches() const;
  void add_slice(SliceSamples slice);

  /// The most memory for all rows of bricks, as a double: see GridSchedule::memory().
  static double memory(const CodingParameters& parameters, std::int64_t threads);

 private:
  void subdivide_all(const std::vector<BrickJob>& jobs);

  const CodingParameters& parameters_;
  GridSchedule schedule_;
  Take take_;
};

}  // namespace tagrid
