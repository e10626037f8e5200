// Values of points, narrow and wide.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>

#include "stages/mesh/tetrahedra.h"
#include "stages/values/points/coding.h"
#include "stages/values/points/field.h"
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

struct RandomField {
  int cube_size;
  Box box;
  LatticeBits active;
  std::vector<std::int32_t> samples;  ///< of all points; only those of active points may have an effect
};

RandomField random_field() {
  RandomField f;
  f.cube_size = *rc::gen::element(4, 8, 16);
  const auto cubes = [&] { return std::int64_t{*rc::gen::inRange(1, 3)} * f.cube_size; };
  const Index3 low = std::int64_t{f.cube_size} * Index3{2, 1, 3};
  f.box = {low, low + Index3{cubes(), cubes(), cubes()}};
  const auto seed = *rc::gen::arbitrary<std::uint64_t>();
  f.active = random_conforming_activity(f.box, f.cube_size, *rc::gen::element(0, 1, 5, 40, 500), seed);
  std::mt19937_64 random(seed);
  const bool extreme = *rc::gen::arbitrary<bool>();
  for_each_point(f.box, [&](Index3) {
    const auto any = static_cast<std::int16_t>(random());
    f.samples.push_back(!extreme ? any : any < 0 ? -32768 : 32767);
  });
  return f;
}

template <class Number>
std::vector<Number> fixed_samples(const RandomField& f) {
  std::vector<Number> values;
  for_each_point(f.box, [&](Index3 p) {
    // The previous values of inactive points must have no effect.
    const std::int32_t sample = f.samples[static_cast<std::size_t>(f.box.offset(p))];
    values.push_back(f.active.test(p) ? static_cast<Number>(sample) * static_cast<Number>(f.cube_size)
                                      : Number{12345});
  });
  return values;
}

RC_GTEST_PROP(Interpolation, IsLinearInEveryLeafTetrahedron, ()) {
  const RandomField f = random_field();
  auto values = fixed_samples<std::int32_t>(f);
  interpolate<std::int32_t>(f.active, f.box, f.cube_size, values);
  LatticeBits seen(f.box);
  for_each_leaf_tetrahedron(f.active, f.box, f.cube_size, 24, [&](const Tetrahedron& t) {
    Box bounds{t.vertices[0], t.vertices[0]};
    for (Index3 v : t.vertices)
      for (int axis = 0; axis < 3; ++axis) {
        bounds.low[axis] = std::min(bounds.low[axis], v[axis]);
        bounds.high[axis] = std::max(bounds.high[axis], v[axis]);
      }
    for_each_point(bounds, [&](Index3 p) {
      std::int64_t weighted = 0;
      bool inside = true;
      for (std::size_t i = 0; i < 4; ++i) {
        auto with_p = t.vertices;
        with_p[i] = p;
        const std::int64_t weight = six_volumes(with_p);
        inside &= weight >= 0;
        weighted += weight * f.cube_size * f.samples[static_cast<std::size_t>(f.box.offset(t.vertices[i]))];
      }
      if (!inside) return;
      seen.set(p);
      RC_ASSERT(weighted == six_volumes(t.vertices) * values[static_cast<std::size_t>(f.box.offset(p))]);
    });
  });
  for_each_point(f.box, [&](Index3 p) { RC_ASSERT(seen.test(p)); });
}

// The definition, point by point, without the row loops.
RC_GTEST_PROP(Interpolation, IsTheMeanOfTheBaseEdgeForAnyBits, ()) {
  RandomField f = random_field();
  std::mt19937_64 random(7);
  for_each_point(f.box, [&](Index3 p) {
    if (random() % 4 == 0) f.active.set(p);
  });
  auto values = fixed_samples<double>(f), expected = values;
  interpolate<double>(f.active, f.box, f.cube_size, values);
  for (int level = 1; level <= max_level(f.cube_size); ++level)
    for_each_point(f.box, [&](Index3 p) {
      const PointClass c = classify(p, f.cube_size);
      if (c.level != level || f.active.test(p)) return;
      const BaseEdge e = base_edge(p, c, f.cube_size);
      const auto at = [&](Index3 q) -> double& {
        return expected[static_cast<std::size_t>(f.box.offset(q))];
      };
      at(p) = (at(e.left) + at(e.right)) * 0.5;
    });
  RC_ASSERT(values == expected);
}

RC_GTEST_PROP(Interpolation, WideAndNarrowNumbersAgree, ()) {
  const RandomField f = random_field();
  auto narrow = fixed_samples<std::int32_t>(f);
  auto wide = fixed_samples<std::int64_t>(f);
  auto floating = fixed_samples<double>(f);
  interpolate<std::int32_t>(f.active, f.box, f.cube_size, narrow);
  interpolate<std::int64_t>(f.active, f.box, f.cube_size, wide);
  interpolate<double>(f.active, f.box, f.cube_size, floating);
  for (std::size_t i = 0; i < narrow.size(); ++i) {
    RC_ASSERT(wide[i] == narrow[i]);
    RC_ASSERT(floating[i] == static_cast<double>(narrow[i]));
  }
}

RC_GTEST_PROP(Interpolation, ReadsItsOwnBoxOfLargerBits, ()) {
  const RandomField f = random_field();
  LatticeBits large(f.box.grown(f.cube_size));
  for (auto& word : large.words()) word = 0x5a5a;
  copy_bits(f.active, large);
  auto values = fixed_samples<std::int32_t>(f), expected = values;
  interpolate<std::int32_t>(f.active, f.box, f.cube_size, expected);
  interpolate<std::int32_t>(large, f.box, f.cube_size, values);
  RC_ASSERT(values == expected);
}

TEST(Rounding, HalvesGoUpOnceAtTheEnd) {
  EXPECT_EQ((from_fixed<std::int16_t, std::int32_t>(-4, 8)), 0);   // -1/2
  EXPECT_EQ((from_fixed<std::int16_t, std::int32_t>(-5, 8)), -1);  // -5/8
  EXPECT_EQ((from_fixed<std::int16_t, std::int32_t>(-12, 8)), -1);
  EXPECT_EQ((from_fixed<std::int16_t, std::int32_t>(4, 8)), 1);
  EXPECT_EQ((from_fixed<std::int16_t, std::int32_t>(3, 8)), 0);
  for (int cube_size : {4, 32, 256})
    for (int sample : {-32768, -1, 0, 1, 32767}) {
      const auto fixed = to_fixed<std::int32_t>(static_cast<std::int16_t>(sample), cube_size);
      EXPECT_EQ((from_fixed<std::int16_t>(fixed, cube_size)), sample);
    }
  const std::vector<std::int32_t> values = {-5, -4, 3, 4, 2040};
  std::vector<std::int16_t> samples(values.size());
  round_to_samples<std::int16_t, std::int32_t>(values, 8, samples);
  EXPECT_EQ(samples, (std::vector<std::int16_t>{-1, 0, 0, 1, 255}));
}

}  // namespace
}  // namespace tagrid
