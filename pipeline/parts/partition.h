// How a volume is cut into parts, which ranks or later runs encode one by one.
#pragma once

#include <cstdint>
#include <vector>

#include "stages/grid/brick_grid.h"

namespace tagrid {

/// No part has more samples, unless a single row of bricks has.
inline constexpr std::int64_t largest_part = std::int64_t{1} << 29;

/// The bricks in the order of their numbers, cut into stretches: complete layers if a sixteenth of the volume
/// (and largest_part) is at least a layer; otherwise equal stretches of the rows of a layer, at least one row
/// each. The result depends on the geometry alone, so that any number of processes can continue a run. The
/// encoded bytes do not depend on parts. See docs/dev/decisions/0016-parts.md.
std::vector<BrickRows> parts_of(const BrickGrid& bricks);

}  // namespace tagrid
