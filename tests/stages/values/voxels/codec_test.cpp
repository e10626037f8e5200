#include "stages/values/voxels/codec.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <limits>
#include <optional>
#include <random>

#include "tests/support/points.h"
#include "tests/support/sanitized.h"

namespace tagrid {
namespace {

template <class T>
struct Brick {
  Box owned;
  LatticeBits activity;
  VoxelBounds bounds;
  std::vector<T> samples;
  Effort effort = Effort::normal;

  VoxelBrick of_voxels() const { return {owned, &activity, bounds, effort}; }
};

Index3 any_size() {
  const auto edge = [] { return *rc::gen::element<std::int64_t>(1, 1, 2, 3, 5, 7, 13, 17, 20, 33); };
  Index3 size{edge(), edge(), edge()};
  if (size.x > 20) size.y = std::min<std::int64_t>(size.y, 13);
  return size;
}

template <class T>
std::vector<T> any_samples(Index3 size, std::mt19937& random) {
  const auto low = std::int64_t{std::numeric_limits<T>::min()},
             high = std::int64_t{std::numeric_limits<T>::max()};
  const int kind = *rc::gen::inRange(0, 7);
  const std::int64_t amplitude = *rc::gen::element<std::int64_t>(1, 3, 20, 200, high - low);
  std::vector<T> samples;
  for (const auto [x, y, z] : points_of(size)) {
    const auto noise = static_cast<std::int64_t>(random() % static_cast<std::uint32_t>(amplitude + 1));
    std::int64_t v = 0;
    if (kind == 0) v = low + noise;
    if (kind == 1) v = (x + y + z) % 2 ? low : high;
    if (kind == 2) v = high - x * y - z + noise;
    if (kind == 3) v = x > size.x / 2 ? high : 0;
    if (kind == 4) v = random() % 50 ? 17 : noise;
    if (kind == 5) v = random() % 2 ? low : high;
    if (kind == 6) v = (x - 5) * (x - 5) + (y - 7) * (y - 7) + z * z < 40 ? 100 + noise : 0;
    samples.push_back(static_cast<T>(std::clamp(v, low, high)));
  }
  return samples;
}

template <class T>
Brick<T> any_brick() {
  std::mt19937 random(*rc::gen::arbitrary<std::uint32_t>());
  Brick<T> brick;
  const Index3 size = any_size(), origin{65, *rc::gen::inRange(0, 70), 1};
  brick.owned = {origin, origin + size - Index3{1, 1, 1}};
  brick.activity = LatticeBits({origin - Index3{1, 0, 1}, brick.owned.high});
  const auto below = [&random](std::int64_t n) {
    return static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(n));
  };
  for (int i = *rc::gen::inRange(0, 200); i-- > 0;)
    brick.activity.set(origin + Index3{below(size.x), below(size.y), below(size.z)});
  brick.bounds.max_error = *rc::gen::element<std::int64_t>(0, 0, 1, 2, 5, 50, 127, 128, 300, 40000, 65535,
                                                           1 << 20, std::numeric_limits<std::int64_t>::max());
  brick.bounds.surface_error = *rc::gen::element<std::int64_t>(-1, -1, 0, 1, 3, 100, 70000);
  brick.samples = any_samples<T>(size, random);
  brick.effort = *rc::gen::element(Effort::normal, Effort::fast, Effort::best);
  return brick;
}

template <class T>
std::vector<std::uint8_t> encoded(const Brick<T>& brick, std::vector<T>& reconstruction) {
  std::vector<std::uint8_t> bytes;
  reconstruction.assign(brick.samples.size(), T{});
  encode_voxels<T>(brick.samples, brick.of_voxels(), reconstruction, bytes).finish();
  return bytes;
}

// Of all slices, or of the first ones.
template <class T>
Status decoded(std::span<const std::uint8_t> bytes, const Brick<T>& brick, std::vector<T>& samples,
               std::int64_t slices = std::numeric_limits<std::int64_t>::max()) {
  const Index3 size = brick.owned.size();
  samples.assign(static_cast<std::size_t>(size.x * size.y * std::min(size.z, slices)), T{});
  std::vector<std::uint8_t> carried;
  return decode_voxels<T>(bytes, brick.of_voxels(), samples, carried);
}

// The code carries bytes that depend on the reconstruction; this changes neither its size nor the voxels.
template <class T>
void check_carrying(const Brick<T>& brick, const std::vector<std::uint8_t>& plain) {
  std::vector<std::uint8_t> bytes,
      to_carry(static_cast<std::size_t>(*rc::gen::element(0, 1, 2, 63, 64, 300))), carried;
  std::vector<T> reconstruction(brick.samples.size()), samples(brick.samples.size());
  auto pending = encode_voxels<T>(brick.samples, brick.of_voxels(), reconstruction, bytes);
  const std::vector<T> then = reconstruction;
  for (std::size_t i = 0; i < to_carry.size(); ++i)
    to_carry[i] = static_cast<std::uint8_t>(7 * i + static_cast<std::size_t>(then[i % then.size()]));
  const bool complete = pending.is_complete();
  const std::optional<std::size_t> finished = pending.finish(to_carry);
  const std::size_t count = finished.value_or(0);
  // A code that was longer than the samples is replaced by them, or by the numbers that stand for `then`.
  RC_ASSERT(reconstruction == then || (!finished && reconstruction == brick.samples));
  RC_ASSERT(count == 0 || count == 2 || count == 64);
  RC_ASSERT(count <= to_carry.size());
  RC_ASSERT(!complete || finished == std::optional<std::size_t>(0));
  RC_ASSERT(complete || !finished || to_carry.size() < 64 || count > 0);
  // Other numbers in the states may take in one word more or less each.
  RC_ASSERT(std::abs(static_cast<std::int64_t>(bytes.size()) - static_cast<std::int64_t>(plain.size())) <=
            64);
  RC_ASSERT(decode_voxels<T>(bytes, brick.of_voxels(), samples, carried).ok());
  RC_ASSERT(samples == reconstruction);
  RC_ASSERT(carried == std::vector<std::uint8_t>(to_carry.begin(),
                                                 to_carry.begin() + static_cast<std::ptrdiff_t>(count)));
}

template <class T>
void check_brick(const Brick<T>& brick) {
  std::vector<T> reconstruction, samples, again;
  const auto bytes = encoded(brick, reconstruction);
  std::size_t i = 0;
  for (const Index3 p : points_of(brick.owned)) {
    const bool surface = brick.bounds.surface_error >= 0 && brick.activity.test(p);
    const std::int64_t bound = surface ? brick.bounds.surface_error : brick.bounds.max_error;
    RC_ASSERT(std::abs(std::int64_t{brick.samples[i]} - reconstruction[i]) <= bound);
    ++i;
  }
  RC_ASSERT(decoded(bytes, brick, samples).ok());
  RC_ASSERT(samples == reconstruction);
  for (std::int64_t slices = 1; slices < brick.owned.size().z; ++slices) {
    RC_ASSERT(decoded(bytes, brick, samples, slices).ok());
    RC_ASSERT(std::equal(samples.begin(), samples.end(), reconstruction.begin()));
  }
  RC_ASSERT(encoded(brick, again) == bytes);
  check_carrying(brick, bytes);
}

RC_GTEST_PROP(VoxelCodec, EveryVoxelWithinTheBoundAndAsTheEncoderSaid, ()) {
  for (int i = 0; i < 8; ++i) {
    check_brick(any_brick<std::uint8_t>());
    check_brick(any_brick<std::int8_t>());
    check_brick(any_brick<std::uint16_t>());
    check_brick(any_brick<std::int16_t>());
  }
}

Brick<std::int16_t> smooth_brick(std::int64_t edge, std::int64_t error, Effort effort = Effort::normal) {
  Brick<std::int16_t> brick{Box::of_size({edge, edge, edge}),
                            LatticeBits(Box::of_size({edge, edge, edge})),
                            {error, -1},
                            {},
                            effort};
  std::mt19937 random(7);
  for (const auto [x, y, z] : points_of(Index3{edge, edge, edge}))
    brick.samples.push_back(
        static_cast<std::int16_t>(x * y - 3 * z * x + static_cast<std::int64_t>(random() % 16)));
  return brick;
}

constexpr std::array efforts = {Effort::normal, Effort::fast, Effort::best};

class VoxelCodecEfforts : public testing::TestWithParam<Effort> {};
INSTANTIATE_TEST_SUITE_P(All, VoxelCodecEfforts, testing::ValuesIn(efforts),
                         [](const auto& test) { return std::string(name_of(test.param)); });

TEST_P(VoxelCodecEfforts, EveryTruncationAndEveryTrailingByteIsFound) {
  const auto brick = smooth_brick(9, 1, GetParam());
  std::vector<std::int16_t> samples;
  auto bytes = encoded(brick, samples);
  for (std::size_t n = 0; n < bytes.size(); ++n)
    EXPECT_FALSE(decoded<std::int16_t>(std::span(bytes).first(n), brick, samples).ok()) << n;
  bytes.push_back(0);
  EXPECT_FALSE(decoded<std::int16_t>(bytes, brick, samples).ok());
}

TEST_P(VoxelCodecEfforts, DamagedBytesAreDecodedOrRefusedWithoutHarm) {
  // A brick of the best effort begins with megabytes of models: fewer bits are tried.
  const std::int64_t edge = GetParam() == Effort::best ? 5 : 9;
  for (const std::int64_t error : {0, 1, 40, 60000}) {
    const auto brick = smooth_brick(edge, error, GetParam());
    std::vector<std::int16_t> samples;
    const auto bytes = encoded(brick, samples);
    // With sanitizers, the fuzzers look at more of them.
    for (std::size_t bit = 0; bit < 8 * bytes.size(); bit += sanitized ? 3 : 1) {
      auto damaged = bytes;
      damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ 1 << (bit % 8));
      const auto slices = static_cast<std::int64_t>(bit % 11);
      (void)decoded<std::int16_t>(damaged, brick, samples, slices > 0 ? slices : edge).ok();
    }
  }
  std::mt19937 random(3);
  const auto brick = smooth_brick(9, 0, GetParam());
  std::vector<std::int16_t> samples;
  for (int i = 0; i < (GetParam() == Effort::best ? 300 : 2000); ++i) {
    std::vector<std::uint8_t> noise(random() % 600);
    for (auto& byte : noise) byte = static_cast<std::uint8_t>(random());
    if (!noise.empty()) noise[0] = 1;
    (void)decoded<std::int16_t>(noise, brick, samples, 1 + i % 9).ok();
  }
}

TEST_P(VoxelCodecEfforts, ConstantBrickTakesAFewBytes) {
  for (const std::int64_t error : {0, 3, 100000}) {
    auto brick = smooth_brick(20, error, GetParam());
    std::fill(brick.samples.begin(), brick.samples.end(), std::int16_t{-1024});
    std::vector<std::int16_t> samples;
    EXPECT_LT(encoded(brick, samples).size(), 16u);
    EXPECT_EQ(samples, brick.samples);
  }
}

TEST_P(VoxelCodecEfforts, FlatSurroundingsCostNextToNothing) {
  auto brick = smooth_brick(65, 0, GetParam());
  for (std::size_t i = 0; i < brick.samples.size(); ++i) {
    const auto x = static_cast<std::int64_t>(i % 65), y = static_cast<std::int64_t>(i / 65 % 65);
    if (x < 28 || x > 36 || y < 28 || y > 36) brick.samples[i] = 0;
  }
  std::vector<std::int16_t> samples;
  const double inside = 9 * 9 * 65;
  EXPECT_LT(8.0 * static_cast<double>(encoded(brick, samples).size()), 8.5 * inside);
}

TEST_P(VoxelCodecEfforts, NoiseCostsNoMoreThanItsSamples) {
  auto brick = smooth_brick(40, 0, GetParam());
  std::mt19937 random(11);
  for (auto& v : brick.samples) v = static_cast<std::int16_t>(random());
  std::vector<std::int16_t> samples;
  EXPECT_LE(encoded(brick, samples).size(), 1 + 2 * brick.samples.size());
  EXPECT_TRUE(samples == brick.samples);
  std::vector<std::int16_t> back;
  EXPECT_TRUE(decoded(encoded(brick, samples), brick, back).ok());
  EXPECT_TRUE(back == brick.samples);
}

// Waves across the axes, with noise: weights that adapt predict them better than one set of weights per
// brick.
TEST(VoxelCodec, MoreEffortGivesSmallerBricks) {
  for (const std::int64_t error : {0, 2}) {
    auto brick = smooth_brick(48, error);
    std::mt19937 random(5);
    std::size_t i = 0;
    for (int z = 0; z < 48; ++z)
      for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 48; ++x, ++i)
          brick.samples[i] =
              static_cast<std::int16_t>((x * (24 + y) / 16 + z) % 32 * 20 + static_cast<int>(random() % 8));
    std::vector<std::int16_t> samples;
    std::array<std::size_t, 3> size{};
    for (const Effort effort : efforts) {
      brick.effort = effort;
      size[static_cast<std::size_t>(effort)] = encoded(brick, samples).size();
    }
    const auto [normal, fast, best] = size;
    EXPECT_LT(normal, fast);
    EXPECT_LT(best, 0.95 * static_cast<double>(normal));
  }
}

}  // namespace
}  // namespace tagrid
