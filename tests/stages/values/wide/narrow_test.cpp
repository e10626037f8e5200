#include "stages/values/wide/codec.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "stages/sample/numbers.h"
#include "stages/values/voxels/codec.h"
#include "tests/support/points.h"

namespace tagrid {
namespace {

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
