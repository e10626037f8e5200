// Bricks with consecutive numbers.
#pragma once

#include <cstdint>
#include <vector>

#include "stages/grid/domain.h"

namespace tagrid {

/// The bricks from `first` to `last`, both included.
struct BrickRun {
  std::int64_t first = 0, last = 0;
  friend constexpr bool operator==(const BrickRun&, const BrickRun&) = default;
};

/// Adds a run that begins after the others, to the last one if it follows without a gap.
inline void append(std::vector<BrickRun>& runs, const BrickRun& run) {
  if (!runs.empty() && runs.back().last == run.first - 1)
    runs.back().last = run.last;
  else
    runs.push_back(run);
}

/// The samples that the bricks of a run own: at most five boxes, which do not overlap.
inline std::vector<Box> boxes_of(const BrickRun& run, const BrickGrid& bricks) {
  std::vector<Box> boxes;
  // The longest stretch from `first` on that is a box: complete layers, complete rows, or a part of a row.
  for (std::int64_t first = run.first; first <= run.last;) {
    const std::int64_t left = run.last - first + 1, row = bricks.bricks(0), layer = bricks.layer_count();
    std::int64_t count = std::min(left, row - first % row);
    if (first % row == 0 && left >= row) {
      const std::int64_t of_layer = std::min(left, layer - first % layer);
      count = of_layer - of_layer % row;
    }
    if (first % layer == 0 && left >= layer) count = left - left % layer;
    boxes.push_back({bricks.owned_box(bricks.position(first)).low,
                     bricks.owned_box(bricks.position(first + count - 1)).high});
    first += count;
  }
  return boxes;
}

}  // namespace tagrid
