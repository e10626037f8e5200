// Values of points, narrow and wide.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>
#include <random>

#include "stages/values/points/coding.h"
#include "tests/support/brick_samples.h"
#include "tests/support/conforming_activity.h"
#include "tests/support/sanitized.h"

namespace tagrid {
namespace {

// Values of active points as bytes and back.

template <class T>
class PointCoding : public testing::Test {};
TYPED_TEST_SUITE(PointCoding, NarrowTypes);

template <class T>
std::vector<std::int64_t> point_errors() {
  const std::int64_t range = std::int64_t{std::numeric_limits<T>::max()} - std::numeric_limits<T>::min();
  return {0, 1, 2, 3, 7, 50, range / 2 - 1, range / 2, range / 2 + 1, range - 1, range};
}

TYPED_TEST(PointCoding, StoredPointsAreWithinTheErrorAndStoredAsThemselves) {
  using Limits = std::numeric_limits<TypeParam>;
  for (const std::int64_t error : point_errors<TypeParam>())
    for (std::int64_t v = Limits::min(); v <= Limits::max(); ++v) {
      const auto value = static_cast<TypeParam>(v);
      const TypeParam stored = stored_point(value, error);
      ASSERT_LE(std::abs(std::int64_t{stored} - v), error) << v;
      ASSERT_EQ(stored_point(stored, error), stored) << v << " error " << error;
      const bool on_lattice = stored % (2 * error + 1) == 0;
      ASSERT_TRUE(on_lattice || stored == Limits::max() || stored == Limits::min()) << v;
      ASSERT_TRUE(error > 0 || stored == value);
    }
}

TYPED_TEST(PointCoding, RoundTripGivesTheStoredValuesOfActivePoints) {
  std::mt19937_64 random(11);
  for (const std::int64_t error : point_errors<TypeParam>())
    for (const int s : {4, 8, 16})
      for (const int marks : {0, 3, 400}) {
        const Box box{{s, 0, 0}, {3 * s, s, 2 * s}};
        const Domain domain{box.high + Index3{1, 1, 1}, s};
        const LatticeBits active = cut(random_activity_of(domain, marks, random()), box);
        const auto volume = random_volume<TypeParam>(domain.dims, random());
        std::vector<TypeParam> values = volume.cut(box);
        for (auto& v : values) v = stored_point(v, error);
        std::vector<std::uint8_t> bytes;
        encode_points<TypeParam>(values, active, s, error, bytes);
        std::vector<TypeParam> decoded(values.size(), 77);
        ASSERT_TRUE(decode_points<TypeParam>(bytes, active, s, error, decoded).ok());
        for_each_point(box, [&](Index3 p) {
          const auto at = static_cast<std::size_t>(box.offset(p));
          ASSERT_EQ(decoded[at], active.test(p) ? values[at] : 77) << "error " << error << " S " << s;
        });
      }
}

// Only active points may affect the written bytes.
TYPED_TEST(PointCoding, InactivePointsAreNotLookedAt) {
  const Box box{{0, 0, 0}, {16, 8, 16}};
  const LatticeBits active = random_activity_of({box.high + Index3{1, 1, 1}, 8}, 30, 5);
  auto values = random_volume<TypeParam>(box.size(), 1).samples;
  std::vector<std::uint8_t> bytes, other;
  encode_points<TypeParam>(values, active, 8, 0, bytes);
  for_each_point(box, [&](Index3 p) {
    if (!active.test(p)) values[static_cast<std::size_t>(box.offset(p))] = 99;
  });
  encode_points<TypeParam>(values, active, 8, 0, other);
  EXPECT_EQ(bytes, other);
}

TYPED_TEST(PointCoding, DamagedBytesNeverCrash) {
  const Box box{{0, 0, 0}, {8, 8, 16}};
  const LatticeBits active = random_activity_of({box.high + Index3{1, 1, 1}, 8}, 40, 5);
  for (const std::int64_t error : {std::int64_t{0}, point_errors<TypeParam>().back()}) {
    auto values = random_volume<TypeParam>(box.size(), 2).samples;
    for (auto& v : values) v = stored_point(v, error);
    std::vector<std::uint8_t> bytes;
    encode_points<TypeParam>(values, active, 8, error, bytes);
    std::vector<TypeParam> decoded(values.size());
    for (std::size_t n = 0; n < bytes.size(); ++n) {
      const std::vector<std::uint8_t> shorter(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(n));
      const Status status = decode_points<TypeParam>(shorter, active, 8, error, decoded);
      EXPECT_FALSE(status.ok() && n % 4 != 0) << n;
    }
    std::mt19937_64 random(3);
    for (int i = 0; i < 300; ++i) {
      auto broken = bytes;
      for (int k = 0; k < 3; ++k) broken[random() % broken.size()] = static_cast<std::uint8_t>(random());
      static_cast<void>(decode_points<TypeParam>(broken, active, 8, error, decoded).ok());
    }
    // Endless ones and zeros: the largest possible residuals.
    for (const std::uint8_t byte : {0, 255}) {
      const std::vector<std::uint8_t> endless(5000, byte);
      static_cast<void>(decode_points<TypeParam>(endless, active, 8, error, decoded).ok());
    }
  }
}

// Untrusted bytes that describe a large brick and end at once take no time.
TYPED_TEST(PointCoding, WhatFollowsTheEndOfTheBytesIsNotDecoded) {
  const Box box{{0, 0, 0}, {32, 32, 32}};
  LatticeBits active(box);
  for_each_point(box, [&](Index3 p) { active.set(p); });
  const auto values = random_volume<TypeParam>(box.size(), 2).samples;
  std::vector<std::uint8_t> bytes;
  encode_points<TypeParam>(values, active, 8, 0, bytes);
  bytes.resize(bytes.size() / 10);
  constexpr TypeParam untouched = 77;
  std::vector<TypeParam> decoded(values.size(), untouched);
  EXPECT_FALSE(decode_points<TypeParam>(bytes, active, 8, 0, decoded).ok());
  EXPECT_GT(std::count(decoded.begin(), decoded.end(), untouched), std::ssize(decoded) / 2);
}

TEST(PointCodingSize, SmoothFieldsCostLittle) {
  const Box box{{0, 0, 0}, {32, 32, 32}};
  LatticeBits active(box);
  for_each_point(box, [&](Index3 p) { active.set(p); });
  const auto plane = oracle::volume_of<std::int16_t>(
      box.size(), [](double x, double y, double z) { return 20 * x - 7 * y + 3 * z; });
  std::vector<std::uint8_t> bytes;
  encode_points<std::int16_t>(plane.samples, active, 32, 0, bytes);
  EXPECT_LT(static_cast<double>(bytes.size()) * 8 / static_cast<double>(box.count()), 1.0);
}

// What only the coder of points of wide types refuses.

template <class T>
class WidePointCoding : public testing::Test {};
TYPED_TEST_SUITE(WidePointCoding, WideIntegers);

// The bit that says whether values escape comes first, so it is a bit of the decoder's first state, and no
// other event depends on it.
TYPED_TEST(WidePointCoding, IntegersThatEscapeAreRefused) {
  constexpr int s = 8;
  const Box box{{0, 0, 0}, {s, 2 * s, s}};
  const Domain domain{box.high + Index3{1, 1, 1}, s};
  const LatticeBits active = cut(random_activity_of(domain, 30, 5), box);
  std::mt19937 random(1);
  std::vector<TypeParam> values(static_cast<std::size_t>(box.count())), decoded(values.size());
  for (TypeParam& value : values) value = static_cast<TypeParam>(random() % 1000);
  for (const double error : {0.0, 7.0}) {
    std::vector<TypeParam> stored = values;
    for (TypeParam& value : stored) value = stored_point(value, error);
    std::vector<std::uint8_t> bytes;
    encode_points<TypeParam>(stored, active, s, error, bytes);
    EXPECT_TRUE(decode_points<TypeParam>(bytes, active, s, error, decoded).ok());
    bytes[1] ^= 0x80;
    EXPECT_FALSE(decode_points<TypeParam>(bytes, active, s, error, decoded).ok());
  }
}

}  // namespace
}  // namespace tagrid
