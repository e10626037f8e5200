#include "stages/values/wide/codec.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "stages/sample/numbers.h"
#include "tests/support/points.h"
#include "tests/support/sanitized.h"

namespace tagrid {
namespace {

constexpr Index3 size{9, 9, 9};

template <class T>
class WideVoxelCodec : public testing::Test {
 protected:
  // Smooth, with noise; floats also with NaNs and a few distinct values.
  std::vector<T> samples() const {
    std::mt19937 random(7);
    std::vector<T> all;
    for (const auto [x, y, z] : points_of(size)) {
      all.push_back(static_cast<T>(1000 + 30 * x + 5 * y * z + static_cast<std::int64_t>(random() % 16)));
      if constexpr (std::is_floating_point_v<T>) {
        if (random() % 40 == 0) all.back() = std::numeric_limits<T>::quiet_NaN();
        if (random() % 40 == 0) all.back() = static_cast<T>(1e30);
      }
    }
    return all;
  }
  std::vector<std::uint8_t> encode(const std::vector<T>& original, const WideBounds& bounds) {
    std::vector<std::uint8_t> bytes;
    reconstruction_.resize(original.size());
    encode_voxels<T>(original, {owned_, &activity_, bounds}, reconstruction_, bytes).finish();
    return bytes;
  }
  Status decode(std::span<const std::uint8_t> bytes, const WideBounds& bounds, std::int64_t slices = size.z) {
    decoded_.assign(static_cast<std::size_t>(size.x * size.y * slices), T{});
    std::vector<std::uint8_t> carried;
    return decode_voxels<T>(bytes, {owned_, &activity_, bounds}, decoded_, carried);
  }

  const Box owned_ = Box::of_size(size);
  LatticeBits activity_ = [] {
    LatticeBits bits(Box::of_size(size));
    for (std::int64_t i = 0; i < 9; ++i) bits.set({i, 8 - i, i}), bits.set({i, 3, 4});
    return bits;
  }();
  std::vector<T> reconstruction_, decoded_;
};

TYPED_TEST_SUITE(WideVoxelCodec, WideTypes);

const WideBounds all_bounds[] = {{0, -1}, {3, -1}, {0.7, -1}, {40, 0}, {40, 5}, {1e9, -1}, {1e-3, 1e-6}};

TYPED_TEST(WideVoxelCodec, ActiveVoxelsKeepTheTighterBoundAndAllAreAsTheEncoderSaid) {
  const auto original = this->samples();
  for (const WideBounds& bounds : all_bounds) {
    const auto bytes = this->encode(original, bounds);
    ASSERT_TRUE(this->decode(bytes, bounds).ok());
    std::size_t i = 0;
    for (std::int64_t z = 0; z < size.z; ++z)
      for (std::int64_t y = 0; y < size.y; ++y)
        for (std::int64_t x = 0; x < size.x; ++x, ++i) {
          ASSERT_TRUE(identical(this->decoded_[i], this->reconstruction_[i]));
          if (identical(original[i], this->decoded_[i])) continue;
          const bool active = bounds.surface_error >= 0 && this->activity_.test({x, y, z});
          const double bound = active ? bounds.surface_error : bounds.max_error;
          EXPECT_GT(bound, 0);
          EXPECT_TRUE(std::isfinite(static_cast<double>(original[i])));
          EXPECT_TRUE(
              within(static_cast<double>(original[i]), static_cast<double>(this->decoded_[i]), bound));
        }
    for (std::int64_t slices = 1; slices < size.z; ++slices) {
      ASSERT_TRUE(this->decode(bytes, bounds, slices).ok());
      EXPECT_TRUE(std::ranges::equal(this->decoded_,
                                     std::span(this->reconstruction_).first(this->decoded_.size()),
                                     [](auto a, auto b) { return identical(a, b); }));
    }
    EXPECT_EQ(this->encode(original, bounds), bytes);
  }
}

TYPED_TEST(WideVoxelCodec, EveryTruncationAndEveryTrailingByteIsFound) {
  const WideBounds bounds{3, -1};
  auto bytes = this->encode(this->samples(), bounds);
  for (std::size_t n = 0; n < bytes.size(); ++n)
    EXPECT_FALSE(this->decode(std::span(bytes).first(n), bounds).ok()) << n;
  bytes.push_back(0);
  EXPECT_FALSE(this->decode(bytes, bounds).ok());
}

TYPED_TEST(WideVoxelCodec, DamagedBytesAreDecodedOrRefusedWithoutHarm) {
  for (const WideBounds& bounds : all_bounds) {
    const auto bytes = this->encode(this->samples(), bounds);
    for (std::size_t bit = 0; bit < 8 * bytes.size(); bit += sanitized ? 11 : bit < 1200 ? 1 : 37) {
      auto damaged = bytes;
      damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ 1 << (bit % 8));
      (void)this->decode(damaged, bounds, bit % 10 == 0 ? size.z : static_cast<std::int64_t>(bit % 10)).ok();
    }
    std::mt19937 random(3);
    for (int i = 0; i < (sanitized ? 100 : 300); ++i) {
      std::vector<std::uint8_t> noise(random() % 600);
      for (auto& byte : noise) byte = static_cast<std::uint8_t>(random());
      if (!noise.empty()) noise[0] = 1;
      (void)this->decode(noise, bounds).ok();
    }
  }
}

TYPED_TEST(WideVoxelCodec, ConstantBrickTakesAFewBytes) {
  auto original = this->samples();
  std::fill(original.begin(), original.end(), TypeParam{17});
  for (const WideBounds& bounds : all_bounds) {
    EXPECT_EQ(this->encode(original, bounds).size(), 1 + sizeof(TypeParam));
    EXPECT_EQ(this->reconstruction_, original);
  }
}

TYPED_TEST(WideVoxelCodec, NoiseCostsLittleMoreThanItsEntropy) {
  auto original = this->samples();
  std::mt19937_64 random(11);
  for (auto& v : original) {
    const std::uint64_t bits = random();
    std::memcpy(&v, &bits, sizeof v);
  }
  EXPECT_LT(static_cast<double>(this->encode(original, {0, -1}).size()),
            1.1 * static_cast<double>(sizeof(TypeParam) * original.size()));
}

// Whole numbers in floats take little more than in integers.
TEST(WideVoxelCodecForms, WholeNumbersInFloatsCostWhatTheyCostAsIntegers) {
  std::mt19937 random(7);
  std::vector<std::int32_t> whole(static_cast<std::size_t>(Box::of_size(size).count()));
  std::int32_t level = -20;
  for (auto& v : whole) v = level += static_cast<std::int32_t>(random() % 9) - 4;
  const std::vector<float> real(whole.begin(), whole.end());
  std::vector<std::uint8_t> as_integers, as_floats;
  auto whole_back = whole;
  auto real_back = real;
  const Box owned = Box::of_size(size);
  encode_voxels<std::int32_t>(whole, WideBrick{owned, nullptr, {}}, whole_back, as_integers).finish();
  encode_voxels<float>(real, WideBrick{owned, nullptr, {}}, real_back, as_floats).finish();
  EXPECT_EQ(real_back, real);
  EXPECT_LT(as_floats.size(), as_integers.size() + 16);
}

TEST(WideNumbers, KeysAreInTheOrderOfTheValues) {
  const float ordered[] = {-INFINITY, -1e38F, -1, -1e-45F, -0.0F, 0.0F, 1e-45F, 1, 1e38F, INFINITY};
  for (std::size_t i = 1; i < std::size(ordered); ++i)
    EXPECT_LT(key_of(ordered[i - 1]), key_of(ordered[i])) << i;
  for (const float v : ordered) EXPECT_TRUE(identical(from_key<float>(key_of(v)), v));
  EXPECT_EQ(key_of(-0.0) + 1, key_of(0.0));
}

TEST(WideNumbers, ABoundIsKeptToTheLastBit) {
  EXPECT_TRUE(within(1, 2, 1));
  EXPECT_FALSE(within(1, std::nextafter(2.0, 3), 1));
  // 1 + 2^-60 rounds to 1.
  EXPECT_FALSE(within(1, -0x1p-60, 1));
  EXPECT_FALSE(within(-0x1p-60, 1, 1));
  EXPECT_TRUE(within(1, 0x1p-60, 1));
  EXPECT_FALSE(within(std::nan(""), 1, 1));
  EXPECT_FALSE(within(-1e308, 1e308, 1.7e308));
}

}  // namespace
}  // namespace tagrid
