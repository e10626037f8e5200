// A volume cut into parts that are encoded by themselves: by several processes, or one after the other so
// that a run that was interrupted goes on where it was.
#pragma once

#include <vector>

#include "stages/grid/brick_rows.h"

namespace tagrid {

/// No part has more samples, unless one row of bricks has.
inline constexpr std::int64_t largest_part = std::int64_t{1} << 29;

/// The bricks in the order of their numbers, cut into stretches: whole layers where a sixteenth of the volume
/// (and largest_part) holds one, else equal stretches of the rows of a layer, at least one row. A function of
/// the geometry alone, so that a run can be continued by any number of processes; what is encoded does not
/// depend on it. See docs/decisions/0016-parts.md.
std::vector<BrickRows> parts_of(const BrickGrid& bricks);

}  // namespace tagrid
