// Decoded samples are on the sides of the original ones, and nearer to them than before.
#include "stages/values/sides/sides.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "stages/sample/numbers.h"
#include "stages/sample/sample_type.h"

namespace tagrid {
namespace {

template <class T>
class Sides : public testing::Test {};
using Types = testing::Types<std::uint8_t, std::int8_t, std::uint16_t, std::int16_t, std::uint32_t,
                             std::int32_t, float, double>;
TYPED_TEST_SUITE(Sides, Types);

// Any sample, most of them from a few hundred near zero; of floats, also those that are not finite.
template <class T>
T any_sample() {
  const auto near = *rc::gen::inRange<int>(std::is_signed_v<T> ? -120 : 0, 120);
  if (*rc::gen::inRange(0, 8) > 0) {
    if constexpr (std::is_floating_point_v<T>) return static_cast<T>(near) / 16;
    return static_cast<T>(near);
  }
  if constexpr (std::is_floating_point_v<T>) {
    using Limits = std::numeric_limits<T>;
    return *rc::gen::element(Limits::infinity(), -Limits::infinity(), Limits::quiet_NaN(), Limits::max(),
                             Limits::lowest(), T{0}, -T{0}, Limits::denorm_min(), -Limits::denorm_min());
  } else {
    return *rc::gen::arbitrary<T>();
  }
}

template <class T>
Thresholds any_thresholds() {
  std::vector<double> values;
  const int count = *rc::gen::inRange(1, 9);
  for (int i = 0; i < count; ++i)
    if (const auto least = threshold_of<T>(static_cast<double>(any_sample<T>())))
      values.push_back(static_cast<double>(*least));
  std::ranges::sort(values);
  values.erase(std::unique(values.begin(), values.end()), values.end());
  Thresholds thresholds;
  for (const double value : values) thresholds.append(value);
  return thresholds;
}

// What a lossy coder may make of a sample.
template <class T>
T decoded_of(T original) {
  if (!is_finite(original)) return original;
  for (;;)
    if (const T decoded = any_sample<T>(); is_finite(decoded)) return decoded;
}

TYPED_TEST(Sides, AreThoseOfTheOriginalAndErrorsAreNotLarger) {
  using T = TypeParam;
  EXPECT_TRUE(rc::check([] {
    const Thresholds thresholds = any_thresholds<T>();
    std::vector<T> original(static_cast<std::size_t>(*rc::gen::inRange(1, 300))), before;
    for (T& sample : original) sample = any_sample<T>();
    for (const T sample : original) before.push_back(decoded_of(sample));
    std::vector<T> after = before;
    OfThresholds<std::uint64_t> moved;
    std::vector<std::uint8_t> code;
    encode_sides<T>(original, thresholds, after, moved, code);
    std::uint64_t changed = 0;
    for (std::size_t i = 0; i < original.size(); ++i) {
      for (const double threshold : thresholds.numbers())
        RC_ASSERT((after[i] >= static_cast<T>(threshold)) == (original[i] >= static_cast<T>(threshold)));
      if (!is_finite(original[i])) {
        RC_ASSERT(identical(after[i], original[i]));
        continue;
      }
      const auto off = [&](T v) {
        return std::abs(static_cast<double>(v) - static_cast<double>(original[i]));
      };
      RC_ASSERT(off(after[i]) <= off(before[i]));
      changed += !identical(after[i], before[i]);
    }
    RC_ASSERT(code.empty() == (changed == 0));
    RC_ASSERT(std::accumulate(moved.all.begin(), moved.all.end(), std::uint64_t{0}) >= changed);
    if (code.empty()) return;

    std::vector<T> restored = before;
    RC_ASSERT(decode_sides<T>(code, thresholds, true, restored).ok());
    RC_ASSERT(std::ranges::equal(restored, after, identical<T>));
    // The first samples alone.
    std::vector<T> first(before.begin(), before.begin() + static_cast<std::ptrdiff_t>(before.size() / 2));
    RC_ASSERT(decode_sides<T>(code, thresholds, false, first).ok());
    RC_ASSERT(std::ranges::equal(first, std::span(after).first(first.size()), identical<T>));
  }));
}

TYPED_TEST(Sides, OfAnyBytesAreRefusedOrDecoded) {
  using T = TypeParam;
  EXPECT_TRUE(rc::check([] {
    const Thresholds thresholds = any_thresholds<T>();
    const auto bytes = *rc::gen::arbitrary<std::vector<std::uint8_t>>();
    std::vector<T> samples(100);
    for (T& sample : samples) sample = any_sample<T>();
    RC_CLASSIFY(decode_sides<T>(bytes, thresholds, true, samples).ok());
  }));
}

// A threshold of a type is the least sample that is at least the value.
TYPED_TEST(Sides, AThresholdIsTheLeastSampleThatIsAtLeastIt) {
  using T = TypeParam;
  EXPECT_TRUE(rc::check([] {
    const double value = static_cast<double>(any_sample<T>()) + *rc::gen::element(0.0, 0.25, 1e-9);
    const auto least = threshold_of<T>(value);
    if (!least) {
      RC_ASSERT(!(value > static_cast<double>(std::numeric_limits<T>::lowest())) ||
                value > static_cast<double>(std::numeric_limits<T>::max()));
      return;
    }
    RC_ASSERT(static_cast<double>(*least) >= value);
    RC_ASSERT(static_cast<double>(below_threshold(*least)) < value);
  }));
}

// Errors that are equally probable up to a bound cost less than a bit for each sample within it.
TEST(SidesOfNoise, TakeLessThanABitForASampleWithinReach) {
  std::vector<std::uint8_t> original(100'000), decoded(original.size()), code;
  std::uint32_t state = 1;
  const auto random = [&](std::uint32_t below) {
    return ((state = state * 1664525 + 1013904223) >> 8 & 0xFFFF) % below;
  };
  std::size_t near = 0;
  for (std::size_t i = 0; i < original.size(); ++i) {
    original[i] = static_cast<std::uint8_t>(random(200) + 20);
    decoded[i] = static_cast<std::uint8_t>(original[i] + random(17) - 8);
    near += decoded[i] >= 120 - 8 && decoded[i] < 120 + 8;
  }
  Thresholds thresholds;
  thresholds.append(120);
  OfThresholds<std::uint64_t> moved;
  encode_sides<std::uint8_t>(original, thresholds, decoded, moved, code);
  EXPECT_LT(8 * code.size(), near);
  EXPECT_GT(8 * code.size(), near / 2);
}

}  // namespace
}  // namespace tagrid
