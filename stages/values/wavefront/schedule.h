// When each voxel of a brick is coded. Sixteen lanes code sixteen rows of a slice, each three voxels behind
// the row above, so that all neighbors that come before a voxel in raster order are decoded before it, and
// sixteen voxels never wait for each other. The even slices and the odd ones are two such wavefronts; the
// second follows the first.
#pragma once

#include <algorithm>
#include <cstdint>

#include "stages/grid/box.h"

namespace tagrid {

inline constexpr int wave_lanes = 16;
inline constexpr int wave_skew = 3;  ///< steps from a lane to the next
inline constexpr int wave_margin =
    2;  ///< steps of a row before its first voxel, and at least as many after its last
inline constexpr int wave_slope = wave_lanes * wave_skew;

/// Rows 16 g .. 16 g + 15 of slice 2 k + h are group k * groups + g of half h. Lane i begins its row of group
/// n in step n * period + 3 i of its half, and codes voxel x in the step x + 2 after that.
struct Schedule {
  Index3 size;
  std::int64_t groups;      ///< of a slice
  std::int64_t period;      ///< steps from a group to the next
  std::int64_t slice;       ///< steps from a slice to the next of its half
  std::int64_t lag;         ///< steps by which the odd slices follow the even ones
  std::int64_t all_groups;  ///< of a half
  std::int64_t steps;       ///< of a half
  std::int64_t all_steps;

  explicit Schedule(Index3 brick)
      : size(brick),
        groups((size.y + wave_lanes - 1) / wave_lanes),
        period(std::max<std::int64_t>(size.x + 2 * wave_margin, wave_slope)),
        slice(groups * period),
        // 32 steps, so that neither half waits for the other. The last row of a group has neighbors in the
        // next group of the slice before; they come a period later.
        lag(groups == 1 ? 32 : std::max<std::int64_t>(32, period - 43)),
        all_groups((size.z + 1) / 2 * groups),
        steps(all_groups * period + wave_slope),
        all_steps(steps + lag) {}

  std::int64_t z_of(int half, std::int64_t group) const { return group / groups * 2 + half; }
  std::int64_t y_of(std::int64_t group) const { return group % groups * wave_lanes; }
  /// Number of rows in a group; 0 outside the brick.
  std::int64_t rows_of(int half, std::int64_t group) const {
    if (group < 0 || group >= all_groups || z_of(half, group) >= size.z) return 0;
    return std::min<std::int64_t>(wave_lanes, size.y - y_of(group));
  }
};

}  // namespace tagrid
