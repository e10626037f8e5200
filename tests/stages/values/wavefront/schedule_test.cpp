// Waves: their bits and their schedule.
#include <iostream>
#include <map>
#include <random>

#include "stages/activity/forecast.h"
#include "stages/sample/instruction_sets.h"
#include "stages/values/prediction/weights.h"
#include "stages/values/voxels/codec.h"
#include "stages/values/wavefront/bits.h"
#include "stages/values/wavefront/schedule.h"
#include "tests/support/encode_volume.h"
#include "tests/support/points.h"
#include "tests/support/sanitized.h"

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

// Every instruction set that the machine has gives the same bytes, and reads them.

struct Coded {
  std::vector<std::uint8_t> bytes;
  std::vector<std::int16_t> decoded;
  std::vector<std::uint8_t> carried;
};

const char* name_of_set(std::int64_t set) {
  return set == HWY_AVX3 ? "AVX-512" : set == HWY_AVX2 ? "AVX2" : set == HWY_SSE4 ? "SSE4" : "any machine";
}

class InstructionSets : public testing::Test {
 protected:
  ~InstructionSets() override { limit_instruction_sets(0); }

  static std::vector<std::int64_t> all() {
    limit_instruction_sets(0);
    std::vector<std::int64_t> sets;
    for (const std::int64_t set : {std::int64_t{HWY_AVX3}, std::int64_t{HWY_AVX2}, std::int64_t{HWY_SSE4},
                                   std::int64_t{HWY_STATIC_TARGET}})
      if ((instruction_sets() & set) != 0) sets.push_back(set);
    return sets;
  }

  /// Smooth, with noise of this amplitude; and an edge, so that some residuals are large.
  static std::vector<std::int16_t> samples_of(Index3 size, int amplitude, std::mt19937& random) {
    std::vector<std::int16_t> samples;
    for (const auto [x, y, z] : points_of(size))
      samples.push_back(static_cast<std::int16_t>(
          (x - 5) * (y + 3) / 4 + (x + y > z + 20 ? 900 : 0) +
          static_cast<std::int64_t>(random() % static_cast<unsigned>(2 * amplitude + 1)) - amplitude));
    return samples;
  }

  static Coded run(const std::vector<std::int16_t>& samples, const VoxelBrick& brick) {
    Coded r;
    r.decoded.resize(samples.size());
    std::vector<std::uint8_t> to_carry(100);
    for (std::size_t i = 0; i < to_carry.size(); ++i) to_carry[i] = static_cast<std::uint8_t>(77 * i + 5);
    const auto count = encode_voxels<std::int16_t>(samples, brick, r.decoded, r.bytes).finish(to_carry);
    r.carried.assign(to_carry.begin(), to_carry.begin() + static_cast<std::ptrdiff_t>(count.value_or(0)));
    return r;
  }
};

// The best effort is slow, and has megabytes of models for each brick.
TEST_F(InstructionSets, GiveTheSameBytesWithTheBestEffort) {
  std::mt19937 random(6);
  for (const Index3 size : {Index3{40, 20, 6}, Index3{1, 40, 3}})
    for (const int amplitude : {3, 30000})
      for (const VoxelBounds bounds : {VoxelBounds{0, -1}, VoxelBounds{5, -1}}) {
        const Box box = Box::of_size(size);
        const auto samples = samples_of(size, amplitude, random);
        std::optional<Coded> first;
        for (const std::int64_t set : all()) {
          limit_instruction_sets(set);
          const Coded other = run(samples, {box, nullptr, bounds, Effort::best});
          if (!first) first = other;
          ASSERT_TRUE(other.bytes == first->bytes) << name_of_set(set);
          ASSERT_TRUE(other.decoded == first->decoded) << name_of_set(set);
        }
      }
}

TEST_F(InstructionSets, GiveTheSameBytesAndReadThem) {
  const auto sets = all();
  for (const std::int64_t set : sets) std::cout << name_of_set(set) << " ";
  std::cout << "\n";
  EXPECT_FALSE(sets.empty());
  std::mt19937 random(5);
  for (const Index3 size : {Index3{64, 40, sanitized ? 6 : 20}, Index3{65, 17, 3}, Index3{1, 40, 9},
                            Index3{130, 33, 4}, Index3{7, 5, 3}})
    for (const int amplitude : sanitized ? std::vector{3, 30000} : std::vector{0, 3, 400, 30000})
      for (const VoxelBounds bounds :
           {VoxelBounds{0, -1}, VoxelBounds{5, -1}, VoxelBounds{40, 0}, VoxelBounds{70000, 1}})
        for (const Effort effort : {Effort::normal, Effort::fast}) {
          const Box box = Box::of_size(size);
          LatticeBits activity(box);
          for (int i = 0; i < 200; ++i)
            activity.set({static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(size.x)),
                          static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(size.y)),
                          static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(size.z))});
          const auto samples = samples_of(size, amplitude, random);
          const VoxelBrick brick{box, &activity, bounds, effort};
          limit_instruction_sets(sets.front());
          const Coded first = run(samples, brick);
          for (const std::int64_t set : sets) {
            limit_instruction_sets(set);
            const Coded other = run(samples, brick);
            ASSERT_TRUE(other.bytes == first.bytes) << name_of_set(set);
            ASSERT_TRUE(other.decoded == first.decoded) << name_of_set(set);
            std::vector<std::int16_t> back(samples.size());
            std::vector<std::uint8_t> carried;
            ASSERT_TRUE(decode_voxels<std::int16_t>(first.bytes, brick, back, carried).ok());
            ASSERT_TRUE(carried == first.carried) << name_of_set(set);
            ASSERT_TRUE(back == first.decoded) << name_of_set(set);
          }
        }
}

TEST_F(InstructionSets, MarkAndForecastTheSamePoints) {
  const Index3 size = {50, 43, sanitized ? 12 : 37};
  std::mt19937 random(6);
  for (const int amplitude : {0, 2, 300}) {
    const auto samples = samples_of(size, amplitude, random);
    CodingParameters parameters{.dims = size, .cube_size = 16, .brick_edge = 4, .field_scale = 16.0 / 65536};
    std::optional<Forecast> first;
    for (const std::int64_t set : all()) {
      limit_instruction_sets(set);
      const Forecast forecast = forecast_activity<std::int16_t>(samples, parameters, {});
      if (!first) first = forecast;
      EXPECT_GT(count_of(forecast.at_least(1)), count_of(forecast.at_least(3)));
      for (const int level : {1, 2, 3})
        EXPECT_TRUE(forecast.at_least(level) == first->at_least(level)) << name_of_set(set);
    }
  }
}

}  // namespace
}  // namespace tagrid
