
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "stages/sample/numbers.h"
#include "stages/values/voxels/codec.h"
#include "stages/values/wide/codec.h"
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
    for (const Index3 p : points_of(size)) {
      const TypeParam before = original[i], after = this->decoded_[i];
      ASSERT_TRUE(identical(after, this->reconstruction_[i++]));
      if (identical(before, after)) continue;
      const bool active = bounds.surface_error >= 0 && this->activity_.test(p);
      const double bound = active ? bounds.surface_error : bounds.max_error;
      EXPECT_GT(bound, 0);
      EXPECT_TRUE(std::isfinite(static_cast<double>(before)));
      EXPECT_TRUE(within(static_cast<double>(before), static_cast<double>(after), bound));
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

constexpr Index3 ct_size{40, 33, 20};

std::vector<std::int16_t> ct(std::mt19937& random) {
  std::vector<std::int16_t> samples;
  for (const auto [x, y, z] : points_of(ct_size))
    samples.push_back(
        static_cast<std::int16_t>((x - 20) * (x - 20) + (y - 16) * (y - 16) < 120 ? 1000 + 3 * z : -1000) +
        static_cast<std::int16_t>(random() % 30));
  return samples;
}

template <class T>
std::vector<T> as(const std::vector<std::int16_t>& samples, double unit) {
  std::vector<T> result;
  for (const std::int16_t v : samples) result.push_back(static_cast<T>(v * unit));
  return result;
}

template <class T>
std::size_t bytes_of_wide(const std::vector<T>& samples, const WideBounds& bounds, Effort effort) {
  const Box box = Box::of_size(ct_size);
  std::vector<std::uint8_t> bytes;
  std::vector<T> decoded(samples.size()), back(samples.size());
  // The bytes that are carried may depend on what was decoded.
  std::vector<std::uint8_t> to_carry(80), carried;
  const WideBrick brick{box, nullptr, bounds, effort};
  auto pending = encode_voxels<T>(samples, brick, decoded, bytes);
  std::memcpy(to_carry.data(), decoded.data(), std::min(to_carry.size(), decoded.size() * sizeof(T)));
  const std::optional<std::size_t> count = pending.finish(to_carry);
  EXPECT_TRUE(decode_voxels<T>(bytes, brick, back, carried).ok());
  EXPECT_EQ(carried.size(), count.value_or(0));
  EXPECT_TRUE(std::equal(carried.begin(), carried.end(), to_carry.begin()));
  for (std::size_t i = 0; i < samples.size(); ++i) {
    EXPECT_TRUE(identical(back[i], decoded[i]));
    EXPECT_TRUE(bounds.max_error == 0 ? identical(back[i], samples[i])
                                      : within(static_cast<double>(back[i]), static_cast<double>(samples[i]),
                                               bounds.max_error));
  }
  return bytes.size();
}

// Whole numbers, and multiples of a power of two, in every wide type, at every effort.
TEST(NarrowForm, CtInAWideTypeTakesTheBytesOfCtInSixteenBits) {
  std::mt19937 random(1);
  const auto samples = ct(random);
  for (const Effort effort : {Effort::normal, Effort::fast, Effort::best})
    for (const double error : {0.0, 2.0, 9.0}) {
      std::vector<std::uint8_t> narrow;
      std::vector<std::int16_t> decoded(samples.size());
      const VoxelBounds bounds{static_cast<std::int64_t>(error), -1};
      encode_voxels<std::int16_t>(samples, {Box::of_size(ct_size), nullptr, bounds, effort}, decoded, narrow)
          .finish();
      const std::size_t most = narrow.size() * 102 / 100 + 16;
      EXPECT_LE(bytes_of_wide(as<float>(samples, 1), {error, -1}, effort), most);
      EXPECT_LE(bytes_of_wide(as<double>(samples, 1), {error, -1}, effort), most);
      EXPECT_LE(bytes_of_wide(as<std::int32_t>(samples, 1), {error, -1}, effort), most);
      EXPECT_LE(bytes_of_wide(as<float>(samples, 0.125), {0.125 * error, -1}, effort), most);
      EXPECT_LE(bytes_of_wide(as<double>(samples, std::ldexp(1, 30)), {std::ldexp(error, 30), -1}, effort),
                most);
    }
}

// Numbers without a common unit are rounded far below the bound.
TEST(NarrowForm, FloatsThatAreNotWholeAreNarrowWithinABoundOnly) {
  std::mt19937 random(2);
  auto samples = as<float>(ct(random), 0.1);
  EXPECT_FALSE(narrow_form<float>(samples, {0, -1}));
  EXPECT_FALSE(narrow_form<float>(samples, {1e-4, -1}));
  const auto form = narrow_form<float>(samples, {0.5, -1});
  ASSERT_TRUE(form);
  EXPECT_GE(form->errors[0], 64);
  bytes_of_wide(samples, {0.5, -1}, Effort::normal);
}

TEST(NarrowForm, WhatHasNoNumberIsNotNarrow) {
  const WideBounds exactly{0, -1}, bounded{0.5, -1};
  std::vector<float> samples = {1, 2, 3, -0.0f};
  EXPECT_FALSE(narrow_form<float>(samples, exactly)) << "-0 would come back as 0";
  EXPECT_TRUE(narrow_form<float>(samples, bounded));
  for (const float strange : {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN(),
                              -std::numeric_limits<float>::infinity()}) {
    samples[3] = strange;
    EXPECT_FALSE(narrow_form<float>(samples, bounded));
  }
  samples[3] = 70000;
  EXPECT_FALSE(narrow_form<float>(samples, exactly));
  const std::vector<std::uint32_t> far = {5, 4294967295U};
  EXPECT_FALSE(narrow_form<std::uint32_t>(far, exactly));
  const std::vector<std::uint32_t> high = {4294900000U, 4294965000U};
  ASSERT_TRUE(narrow_form<std::uint32_t>(high, exactly));
}

// Numbers between two samples have to be samples, too: above 2^24, only every second integer is a float.
TEST(NarrowForm, DecodedNumbersAreExact) {
  const std::vector<float> samples = {16777215, 16777218};
  EXPECT_FALSE(narrow_form<float>(samples, WideBounds{0, -1}));
  const std::vector<double> doubles = {16777215, 16777218};
  EXPECT_TRUE(narrow_form<double>(doubles, WideBounds{0, -1}));
  const std::vector<float> tiny = {std::numeric_limits<float>::denorm_min(),
                                   5 * std::numeric_limits<float>::denorm_min()};
  const auto form = narrow_form<float>(tiny, WideBounds{0, -1});
  ASSERT_TRUE(form);
  EXPECT_EQ(form->exponent, -149);
}

// Numbers are at most 2^46, and sums are rounded.
TEST(NarrowForm, LargeNumbersComeBackOrAreNotNarrow) {
  std::mt19937_64 random(3);
  for (const double offset : {0.0, 1e12, 6e13, 8e13, 1e15, 9e15})
    for (const double unit : {1.0, 0x1p-20, 0x1p40})
      for (const double bound : {0.0, 0.6, 3.0}) {
        std::vector<double> samples;
        for (std::int64_t i = 0; i < ct_size.x * ct_size.y * ct_size.z; ++i)
          samples.push_back((offset + static_cast<double>(random() % 5000) * (bound > 1 ? 0.37 : 1)) * unit);
        bytes_of_wide(samples, {bound * unit, -1}, Effort::normal);
      }
}

TEST(NarrowForm, TheLargestFloatsAreNotRoundedToInfinity) {
  std::vector<float> samples;
  const float most = std::numeric_limits<float>::max();
  for (std::int64_t i = 0; i < ct_size.x * ct_size.y * ct_size.z; ++i)
    samples.push_back(i % 7 == 0 ? most : most / 2 + static_cast<float>(i) * 1e33f);
  bytes_of_wide(samples, {2e35, -1}, Effort::normal);
  for (float& v : samples) v = -v;
  bytes_of_wide(samples, {2e35, -1}, Effort::normal);
}

}  // namespace
}  // namespace tagrid
