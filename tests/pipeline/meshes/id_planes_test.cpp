// The numbers of points on faces between bricks take the memory of one layer of bricks.
#include "pipeline/meshes/id_planes.h"

#include <gtest/gtest.h>

#include "pipeline/meshes/point_ids.h"
#include "tests/support/conforming_activity.h"
#include "tests/support/counted_heap.h"
#include "tests/support/sanitized.h"

namespace tagrid {
namespace {

Box all_positions(const BrickGrid& bricks) {
  return Box::of_size({bricks.bricks(0), bricks.bricks(1), bricks.bricks(2)});
}

// The peak of the heap while all points of a volume get ids.
std::uint64_t peak_of(const BrickGrid& bricks) {
  const Box all = all_positions(bricks);
  const HeapPeak peak;
  PointIds ids(bricks, all);
  std::int64_t next = 0;
  for_each_point(all, [&](Index3 position) {
    ids.begin_brick(position);
    for_each_point_of(bricks.closed_box(position), [&](Index3 p) {
      if (ids.of(p) == PointIds::none) ids.of(p) = next++;
    });
    ids.end_brick();
  });
  const Index3 points = {bricks.closed_box(all.high).high.x + 1, bricks.closed_box(all.high).high.y + 1,
                         bricks.closed_box(all.high).high.z + 1};
  EXPECT_EQ(next, points.x * points.y * points.z) << "every point has one id";
  return peak.bytes();
}

TEST(IdPlanes, TheirMemoryFollowsALayerOfBricksAndNotTheDepth) {
  if (sanitized) GTEST_SKIP() << "a sanitizer allocates in its own way";
  const BrickGrid two{{{70, 50, 17}, 8}, 1};
  const std::uint64_t peak = peak_of(two);
  EXPECT_LE(peak, PointIds::working_bytes(two, all_positions(two)));
  EXPECT_GE(peak + 4096, PointIds::working_bytes(two, all_positions(two)));
  for (const std::int64_t depth : {65, 800}) {
    const BrickGrid deep{{{70, 50, depth}, 8}, 1};
    EXPECT_EQ(peak_of(deep), peak) << depth;
    for (const int scale : {1, 2})
      EXPECT_EQ(IdPlanes::working_bytes(deep, all_positions(deep), scale),
                IdPlanes::working_bytes(two, all_positions(two), scale));
  }
}

// docs/design.md states this formula.
TEST(IdPlanes, TheirMemoryIsThatOfTheFormula) {
  const BrickGrid bricks{{{1000, 900, 3000}, 32}, 2};
  const std::uint64_t nx = 1025, ny = 929, w = 65;
  EXPECT_EQ(PointIds::working_bytes(bricks, all_positions(bricks)),
            8 * (w * w * w + w * w + nx * w + nx * ny));
}

}  // namespace
}  // namespace tagrid
