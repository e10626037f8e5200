// Every block belongs to one stretch of rows of bricks, which reads all of its samples.
#include "pipeline/overview/sums.h"

#include <gtest/gtest.h>

#include <set>
#include <utility>

#include "pipeline/grid/schedule.h"

namespace tagrid {
namespace {

void require_one_stretch_for_each_block(const CodingParameters& p) {
  const BrickGrid bricks = p.bricks();
  std::set<std::pair<std::int64_t, std::int64_t>> owned;
  for (std::int64_t j = 0; j < bricks.bricks(1); ++j)
    for (std::int64_t k = 0; k < bricks.bricks(2); ++k) {
      const BrickRows rows = {j, j + 1, k, k + 1};
      const Box blocks = blocks_of_rows(p, rows),
                read = p.domain().samples_at(GridSchedule(p, rows, {}).samples());
      for (std::int64_t b = blocks.low.y; b <= blocks.high.y; ++b)
        for (std::int64_t c = blocks.low.z; c <= blocks.high.z; ++c) {
          EXPECT_TRUE(owned.emplace(b, c).second);
          EXPECT_GE(b * block_edge, read.low.y);
          EXPECT_LE(std::min(b * block_edge + 3, p.dims.y - 1), read.high.y);
          EXPECT_GE(c * block_edge, read.low.z);
          EXPECT_LE(std::min(c * block_edge + 3, p.dims.z - 1), read.high.z);
        }
    }
  EXPECT_EQ(static_cast<std::int64_t>(owned.size()), blocks_along(p.dims.y) * blocks_along(p.dims.z));
}

TEST(BlocksOfRows, EveryBlockBelongsToOneStretchThatReadsItsSamples) {
  for (const int lead : {0, 1})
    for (const int cube : {4, 8})
      for (const int edge : {1, 2, 3})
        for (std::int64_t y = 1; y < 60; ++y) {
          CodingParameters p;
          p.dims = {3, y, 61 - y};
          p.cube_size = cube;
          p.brick_edge = edge;
          p.lead = lead;
          require_one_stretch_for_each_block(p);
        }
}

}  // namespace
}  // namespace tagrid
