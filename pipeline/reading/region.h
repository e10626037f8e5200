// A region of a volume: which bricks hold its samples, and where these go.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "stages/brick/codec.h"
#include "stages/grid/box.h"
#include "stages/grid/brick_grid.h"
#include "stages/sample/coding_parameters.h"
#include "stages/sample/samples.h"

namespace tagrid {

/// The samples of `box` (both ends included) at low, low + step, low + 2 * step, ... along each axis. They are
/// points of the lattice.
struct Region {
  Box box;
  Index3 step = {1, 1, 1};

  /// The number of samples along each axis.
  constexpr Index3 shape() const {
    Index3 shape;
    for (int axis = 0; axis < 3; ++axis) shape[axis] = (box.high[axis] - box.low[axis]) / step[axis] + 1;
    return shape;
  }
  /// The samples of the region that lie in `part`, as a box of their numbers along each axis; may be empty.
  constexpr Box numbers_in(const Box& part) const {
    Box numbers;
    for (int axis = 0; axis < 3; ++axis) {
      const std::int64_t low = std::max(part.low[axis] - box.low[axis], std::int64_t{0});
      numbers.low[axis] = low > 0 ? (low - 1) / step[axis] + 1 : 0;
      const std::int64_t high = std::min(part.high[axis], box.high[axis]) - box.low[axis];
      numbers.high[axis] = high < 0 ? -1 : high / step[axis];
    }
    return numbers;
  }
  constexpr Index3 sample(Index3 number) const {
    return {box.low.x + number.x * step.x, box.low.y + number.y * step.y, box.low.z + number.z * step.z};
  }
};

/// The numbers of the bricks that own a sample of the region, in increasing order.
std::vector<std::int64_t> bricks_of(const Region& region, const BrickGrid& bricks);

/// How many of the slices that a brick owns reach to the last one of the region in it; at least one.
std::int64_t slices_until(const Region& region, const Box& owned);

/// Stores the samples of the region that a brick owns, by `out` and `strides`. Returns the number of bytes.
std::uint64_t copy_samples(const DecodedBrick& brick, const CodingParameters& parameters,
                           const Region& region, std::byte* out, const Strides& strides);

}  // namespace tagrid
