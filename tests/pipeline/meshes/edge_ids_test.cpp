// Ids of points, on edges and in planes.
#include <map>
#include <tuple>

#include "pipeline/meshes/id_planes.h"
#include "tests/support/conforming_activity.h"
#include "tests/support/counted_heap.h"
#include "tests/support/sanitized.h"

namespace tagrid {
namespace {

// Bricks use random edges; each must get the id that any earlier brick gave to it, if one did.
void check(const BrickGrid& bricks, const Box& positions, unsigned rarely, std::uint64_t seed) {
  EdgeIds ids(bricks, positions);
  std::map<std::tuple<std::int64_t, std::int64_t, std::int64_t>, std::int64_t> known;
  std::mt19937_64 random(seed);
  std::int64_t next = 0;
  for_each_point(positions, [&](Index3 position) {
    const Box closed = bricks.closed_box(position);
    ids.begin_brick(position);
    std::vector<std::pair<Index3, std::int64_t>> used;
    for_each_point({2 * closed.low, 2 * closed.high}, [&](Index3 sum) {
      if (random() % rarely != 0) return;
      const auto [found, is_new] = known.try_emplace({sum.x, sum.y, sum.z}, next);
      ASSERT_EQ(ids.carried(sum), is_new ? EdgeIds::none : found->second);
      next += is_new;
      used.emplace_back(sum, found->second);
    });
    ids.clear_high_faces();
    for (const auto& [sum, id] : used)
      if (ids.is_shared(sum)) ids.leave(sum, id);
  });
}

TEST(EdgeIds, AnEdgeHasOneIdWhicheverBricksUseIt) {
  std::uint64_t seed = 1;
  for (const Index3 dims : {Index3{13, 11, 14}, {5, 5, 5}, {22, 3, 9}, {4, 17, 4}})
    for (const int edge : {1, 2})
      for (const unsigned rarely : {1U, 2U, 10U}) {
        const BrickGrid bricks{{dims, 4}, edge};
        const Box all = Box::of_size({bricks.bricks(0), bricks.bricks(1), bricks.bricks(2)});
        check(bricks, all, rarely, seed++);
        Box part = all;
        for (int axis = 0; axis < 3; ++axis)
          if (all.high[axis] > 1) part.low[axis] = 1;
        check(bricks, part, rarely, seed++);
      }
}

TEST(EdgeIds, TakeTheMemoryThatIsStated) {
  if (sanitized) GTEST_SKIP() << "a sanitizer allocates in its own way";
  const BrickGrid bricks{{{45, 39, 30}, 8}, 2};
  const Box all = Box::of_size({bricks.bricks(0), bricks.bricks(1), bricks.bricks(2)});
  const HeapPeak peak;
  EdgeIds ids(bricks, all);
  for_each_point(all, [&](Index3 position) {
    ids.begin_brick(position);
    ids.clear_high_faces();
  });
  EXPECT_LE(peak.bytes(), EdgeIds::working_bytes(bricks, all));
  EXPECT_LE(EdgeIds::working_bytes(bricks, all), peak.bytes() + 4096);
}

// The numbers of points on faces between bricks take the memory of one layer of bricks.

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

// docs/dev/design.md states this formula.
TEST(IdPlanes, TheirMemoryIsThatOfTheFormula) {
  const BrickGrid bricks{{{1000, 900, 3000}, 32}, 2};
  const std::uint64_t nx = 1025, ny = 929, w = 65;
  EXPECT_EQ(PointIds::working_bytes(bricks, all_positions(bricks)),
            8 * (w * w * w + w * w + nx * w + nx * ny));
}

}  // namespace
}  // namespace tagrid
