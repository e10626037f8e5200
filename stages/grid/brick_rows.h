// Complete rows of bricks along x that are processed together.
#pragma once

#include <cstdint>

#include "stages/grid/domain.h"

namespace tagrid {

/// Rows y_low .. y_end - 1 of the layers z_low .. z_end - 1. Rows that are read or written as one stretch of
/// a file have one layer, or all rows of each layer: so their bricks are consecutive.
struct BrickRows {
  std::int64_t y_low = 0, y_end = 0;
  std::int64_t z_low = 0, z_end = 0;

  static constexpr BrickRows all(const BrickGrid& bricks) {
    return {0, bricks.bricks(1), 0, bricks.bricks(2)};
  }

  constexpr std::int64_t first_brick(const BrickGrid& bricks) const { return bricks.id({0, y_low, z_low}); }
  /// Number of bricks in one of the layers.
  constexpr std::int64_t layer_count(const BrickGrid& bricks) const {
    return (y_end - y_low) * bricks.bricks(0);
  }
  constexpr std::int64_t count(const BrickGrid& bricks) const {
    return layer_count(bricks) * (z_end - z_low);
  }
  friend constexpr bool operator==(const BrickRows&, const BrickRows&) = default;
};

}  // namespace tagrid
