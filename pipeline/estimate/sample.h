// A sample of the bricks of a volume, of which the others can be inferred.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "io/volume/volume_source.h"
#include "pipeline/grid/slices.h"
#include "stages/grid/brick_grid.h"

namespace tagrid {

/// A brick that was looked at.
struct SurveyedBrick {
  std::int64_t id = 0;
  std::vector<double> roughness;  ///< for every step; see roughness()
  double share = 0;               ///< in the roughness of all bricks, summed over the steps
};

struct BrickSample {
  std::vector<SurveyedBrick> bricks;  ///< in the order of their shares
  std::vector<std::size_t> chosen;    ///< places in `bricks`
  ValueRange range;                   ///< of the samples of all bricks that were looked at
};

/// The most bricks that are chosen: 16 million samples or all of the volume, but at most 4096 bricks.
std::int64_t most_chosen(const BrickGrid& grid);

/// How many bricks are looked at, and how many of these are chosen.
struct SampleSize {
  double bytes = 1 << 30;   ///< of samples that are looked at
  std::int64_t bricks = 1;  ///< that are chosen at most
};

/// Looks at all bricks, or at rows spread over a volume of more than `size.bytes`; chooses more of the rough
/// ones. Works on the threads of the arena. REQUIRES: source.traits().any_rows; steps > 0.
BrickSample sample_bricks(VolumeSource& source, const BrickGrid& grid, std::span<const double> steps,
                          const SampleSize& size);

}  // namespace tagrid
