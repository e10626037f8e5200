// Waves: their bits and their schedule.
#include <gtest/gtest.h>

#include <map>

#include "stages/values/prediction/weights.h"
#include "stages/values/wavefront/bits.h"
#include "stages/values/wavefront/schedule.h"
#include "tests/support/points.h"

namespace tagrid {
namespace {

std::int64_t step_of(const Schedule& s, Index3 p) {
  const std::int64_t group = p.z / 2 * s.groups + p.y / wave_lanes;
  return group * s.period + wave_skew * (p.y % wave_lanes) + p.x + wave_margin + p.z % 2 * s.lag;
}

template <class Visit>
void for_each_size(Visit visit) {
  for (const std::int64_t x : {1, 2, 17, 44, 45, 64, 65, 74, 75, 76, 130})
    for (const std::int64_t y : {1, 2, 15, 16, 17, 33})
      for (const std::int64_t z : {1, 2, 3, 5}) visit(Index3{x, y, z});
}

template <class Visit>
void for_each_voxel(Index3 size, Visit visit) {
  for (const auto [x, y, z] : points_of(size)) visit(Index3{x, y, z});
}

// A step of the even slices begins before that of the odd ones before it has ended, so these need two steps.
TEST(Schedule, EveryNeighbourComesBeforeTheVoxel) {
  for_each_size([](Index3 size) {
    const Schedule s(size);
    for_each_voxel(size, [&](Index3 p) {
      for (const Tap& tap : taps) {
        const Index3 q = p + Index3{tap.dx, tap.dy, tap.dz};
        if (!Box::of_size(size).contains(q)) continue;
        const std::int64_t least = p.z % 2 == 0 && q.z % 2 == 1 ? 2 : 1;
        ASSERT_GE(step_of(s, p) - step_of(s, q), least) << size.x << " " << size.y << " " << size.z;
      }
    });
  });
}

TEST(Schedule, ALaneHasOneVoxelAtATime) {
  for_each_size([](Index3 size) {
    const Schedule s(size);
    std::map<std::array<std::int64_t, 3>, int> voxels;
    for_each_voxel(size, [&](Index3 p) { ++voxels[{step_of(s, p), p.z % 2, p.y % wave_lanes}]; });
    for (const auto& [place, count] : voxels) ASSERT_EQ(count, 1);
  });
}

TEST(Schedule, StepsEndWithTheLastVoxel) {
  for_each_size([](Index3 size) {
    const Schedule s(size);
    for_each_voxel(size, [&](Index3 p) { ASSERT_LT(step_of(s, p), s.all_steps); });
  });
}

TEST(Schedule, GroupsHaveAllRows) {
  for_each_size([](Index3 size) {
    const Schedule s(size);
    std::int64_t rows = 0;
    for (int half = 0; half < 2; ++half)
      for (std::int64_t group = -1; group <= s.all_groups; ++group) rows += s.rows_of(half, group);
    EXPECT_EQ(rows, size.y * size.z);
  });
}
TEST(WaveBits, NumbersComeBack) {
  std::vector<std::uint8_t> bytes;
  BitWriter writer(bytes);
  for (std::uint32_t n = 0; n < 70000; n = n < 600 ? n + 1 : n * 3) {
    writer.put_number(n);
    writer.put(n & 7, 3);
  }
  writer.finish();
  BitReader reader(bytes);
  for (std::uint32_t n = 0; n < 70000; n = n < 600 ? n + 1 : n * 3) {
    ASSERT_EQ(reader.get_number(), n);
    ASSERT_EQ(reader.get(3), n & 7);
  }
  EXPECT_TRUE(reader.finished());
}

TEST(WaveBits, AnythingElseThanTheEndIsNoticed) {
  const std::vector<std::uint8_t> bytes = {0x0f, 0x01};
  BitReader early(bytes);
  early.get(8);
  EXPECT_FALSE(early.finished()) << "a byte is left";
  BitReader rest(bytes);
  rest.get(8);
  rest.get(1);
  EXPECT_TRUE(rest.finished());
  BitReader ones(bytes);
  ones.get(8);
  EXPECT_FALSE(ones.finished());
  BitReader beyond(bytes);
  beyond.get(17);
  EXPECT_FALSE(beyond.finished()) << "a byte behind the end was used";
  BitReader none({});
  EXPECT_TRUE(none.finished());
  EXPECT_EQ(none.get(5), 0U);
  EXPECT_FALSE(none.finished());
}

// Whatever the bits are: a number has at most 18 digits.
TEST(WaveBits, NumbersOfBrokenStreamsAreLimited) {
  const std::vector<std::uint8_t> bytes(100, 0xff);
  BitReader reader(bytes);
  for (int i = 0; i < 20; ++i) EXPECT_LT(reader.get_number(), 1U << 19);
}

}  // namespace
}  // namespace tagrid
