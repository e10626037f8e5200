#include "pipeline/meshes/edge_ids.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <tuple>

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

}  // namespace
}  // namespace tagrid
