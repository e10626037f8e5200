// Root cubes cover the volume, bricks cover the root cubes, every sample has one owner.
#include "stages/grid/brick_grid.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <vector>

#include "stages/sample/coding_parameters.h"
#include "tests/support/conforming_activity.h"

namespace tagrid {
namespace {

Index3 random_dims(int longest) {
  const auto length = [&] { return std::int64_t{*rc::gen::inRange(1, longest + 1)}; };
  return {length(), length(), length()};
}

RC_GTEST_PROP(Domain, IsTheSmallestOfWholeRootCubesThatHoldsEverySample, ()) {
  const int s = *rc::gen::element(4, 8, 16, 32, 64, 128, 256);
  const Domain domain{random_dims(700), s, *rc::gen::inRange(0, 2)};
  RC_ASSERT(domain.padded().contains(domain.volume()));
  RC_ASSERT(domain.padded().low == (Index3{0, 0, 0}));
  for (int axis = 0; axis < 3; ++axis) {
    RC_ASSERT(domain.padded().high[axis] % s == 0);
    RC_ASSERT(domain.padded().high[axis] == domain.cubes(axis) * s);
    RC_ASSERT(domain.cubes(axis) >= 1);
    // One cube less would not be enough.
    RC_ASSERT(domain.cubes(axis) == 1 || (domain.cubes(axis) - 1) * s < domain.volume().high[axis]);
  }
}

TEST(VolumeSize, HasLimitsOfEachAxisAndOfAll) {
  constexpr std::int64_t largest = std::int64_t{1} << 31;
  EXPECT_TRUE(is_volume_size({1, 1, 1}));
  EXPECT_TRUE(is_volume_size({largest, largest / 16, 1}));
  EXPECT_TRUE(is_volume_size({1 << 20, 1 << 19, 1 << 19}));
  EXPECT_FALSE(is_volume_size({1 << 20, 1 << 19, (1 << 19) + 1}));
  EXPECT_FALSE(is_volume_size({largest, largest / 16 + 1, 1}));
  for (int axis = 0; axis < 3; ++axis)
    for (const std::int64_t size : {std::int64_t{-1}, std::int64_t{0}, largest + 1}) {
      Index3 dims{1, 1, 1};
      dims[axis] = size;
      EXPECT_FALSE(is_volume_size(dims)) << axis << ' ' << size;
    }
}

TEST(Domain, CountsCubesAtTheBorderOfASize) {
  const auto cubes = [](std::int64_t n) { return Domain{{n, 1, 1}, 32}.cubes(0); };
  EXPECT_EQ(cubes(1), 1);
  EXPECT_EQ(cubes(2), 1);
  EXPECT_EQ(cubes(32), 1);
  EXPECT_EQ(cubes(33), 1);
  EXPECT_EQ(cubes(34), 2);
  EXPECT_EQ(cubes(65), 2);
  EXPECT_EQ(cubes(66), 3);
}

TEST(Domain, BeginsOneStepBeforeTheFirstSampleIfItHasALead) {
  const Domain domain{{512, 2, 1}, 32, 1};
  EXPECT_EQ(domain.first(), (Index3{1, 1, 0})) << "the plane of an only slice stays a face of root cubes";
  EXPECT_EQ(domain.cubes(0), 16);
  EXPECT_EQ(domain.volume(), (Box{{1, 1, 0}, {512, 2, 0}}));
  EXPECT_EQ(domain.samples_at(domain.volume()), Box::of_size({512, 2, 1}));
  const auto cubes = [](std::int64_t n) { return Domain{{n, 1, 1}, 32, 1}.cubes(0); };
  EXPECT_EQ(cubes(1), 1);
  EXPECT_EQ(cubes(2), 1);
  EXPECT_EQ(cubes(32), 1);
  EXPECT_EQ(cubes(33), 2);
  EXPECT_EQ(cubes(64), 2);
  EXPECT_EQ(cubes(65), 3);
}

RC_GTEST_PROP(BrickGrid, WithALeadAnAlignedChunkIsABrick, ()) {
  const BrickGrid bricks{{random_dims(300), *rc::gen::element(4, 16, 32), 1}, *rc::gen::inRange(1, 4)};
  for (std::int64_t id = 0; id < bricks.count(); ++id) {
    const Index3 low = bricks.length() * bricks.position(id), edges = bricks.length() * Index3{1, 1, 1};
    RC_ASSERT(bricks.domain.samples_at(bricks.owned_box(bricks.position(id))) ==
              intersection({low, low + edges - Index3{1, 1, 1}}, Box::of_size(bricks.domain.dims)));
  }
}

RC_GTEST_PROP(PointsUpToLevel, EqualALiteralCount, ()) {
  const int s = *rc::gen::element(4, 8, 16);
  const Domain domain{random_dims(40), s, *rc::gen::inRange(0, 2)};
  std::vector<std::uint64_t> expected(static_cast<std::size_t>(max_level(s)) + 1);
  for_each_point(domain.padded(),
                 [&](Index3 p) { ++expected[static_cast<std::size_t>(classify(p, s).level)]; });
  for (std::size_t l = 1; l < expected.size(); ++l) expected[l] += expected[l - 1];
  RC_ASSERT(points_up_to_level(domain) == expected);
}

// The non-adaptive grids of the paper's tables.
TEST(PointsUpToLevel, AreThoseOfThePaper) {
  const auto lobster = points_up_to_level({{321, 321, 33}, 32});
  EXPECT_EQ(lobster[0], 242U);
  EXPECT_EQ(lobster[3], 1323U);
  EXPECT_EQ(lobster[6], 8405U);
  EXPECT_EQ(lobster[9], 59049U);
  EXPECT_EQ(lobster[12], 440657U);
  EXPECT_EQ(lobster[15], 3400353U);
  const auto foot = points_up_to_level({{161, 321, 129}, 32});
  EXPECT_EQ(foot[9], 109593U);
  EXPECT_EQ(foot[12], 847665U);
}

RC_GTEST_PROP(BrickGrid, EverySampleHasOneOwner, ()) {
  const BrickGrid bricks{{random_dims(40), *rc::gen::element(4, 8, 16), *rc::gen::inRange(0, 2)},
                         *rc::gen::inRange(1, 4)};
  const Box volume = bricks.domain.volume();
  std::vector<int> owners(static_cast<std::size_t>(volume.count()));
  for (std::int64_t id = 0; id < bricks.count(); ++id) {
    const Index3 position = bricks.position(id);
    RC_ASSERT(bricks.id(position) == id);
    const Box owned = bricks.owned_box(position), closed = bricks.closed_box(position);
    RC_ASSERT(!owned.empty());
    RC_ASSERT(closed.contains(owned));
    RC_ASSERT(volume.contains(owned));
    for_each_point(owned, [&](Index3 p) { ++owners[static_cast<std::size_t>(volume.offset(p))]; });
    // A point outside the volume repeats a sample of its own brick.
    for_each_point(closed, [&](Index3 p) {
      for (int axis = 0; axis < 3; ++axis)
        if (position[axis] > 0 && p[axis] == closed.low[axis]) return;
      RC_ASSERT(owned.contains(volume.nearest(p)));
    });
  }
  for (const int n : owners) RC_ASSERT(n == 1);
}

RC_GTEST_PROP(BrickGrid, ClosedBoxesMeetAtSharedFacesAndFillTheDomain, ()) {
  const BrickGrid bricks{{random_dims(200), *rc::gen::element(4, 16, 64), *rc::gen::inRange(0, 2)},
                         *rc::gen::inRange(1, 4)};
  const Box padded = bricks.domain.padded();
  for (std::int64_t id = 0; id < bricks.count(); ++id) {
    const Index3 position = bricks.position(id);
    const Box box = bricks.closed_box(position);
    for (int axis = 0; axis < 3; ++axis) {
      RC_ASSERT(box.high[axis] > box.low[axis]);
      RC_ASSERT(box.low[axis] % bricks.domain.cube_size == 0);
      if (position[axis] == 0) RC_ASSERT(box.low[axis] == 0);
      if (position[axis] + 1 == bricks.bricks(axis))
        RC_ASSERT(box.high[axis] == padded.high[axis]);
      else
        RC_ASSERT(bricks.closed_box(position + unit_vector(axis)).low[axis] == box.high[axis]);
    }
  }
}

}  // namespace
}  // namespace tagrid
