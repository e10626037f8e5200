// Samples become the values that they mean: exactly, or not at all.
#include "stages/sample/value_rule.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

namespace tagrid {
namespace {

template <class T>
std::vector<std::byte> bytes_of(const std::vector<T>& numbers) {
  std::vector<std::byte> bytes(numbers.size() * sizeof(T));
  std::memcpy(bytes.data(), numbers.data(), bytes.size());
  return bytes;
}

/// Samples at both ends of the type and around 0.
template <class From>
std::vector<From> samples() {
  using L = std::numeric_limits<From>;
  return {L::lowest(), L::max(), From{0}, From{1}, From{100}, static_cast<From>(L::max() / 2),
          From{7},     From{3}};
}

template <class From, class To>
void expect_exact_or_refused(double intercept, double slope = 1) {
  const std::vector<From> all = samples<From>();
  const ValueRule rule{sample_type_of<From>(), sample_type_of<To>(), {slope}, {intercept}};
  bool fits = true;
  std::vector<To> truth;
  for (const From sample : all) {
    const auto value = static_cast<long double>(slope) * static_cast<long double>(sample) +
                       static_cast<long double>(intercept);
    fits = fits && value >= std::numeric_limits<To>::lowest() && value <= std::numeric_limits<To>::max();
    truth.push_back(fits ? static_cast<To>(value) : To{0});
  }
  const std::vector<std::byte> before = bytes_of(all);
  std::vector<std::byte> bytes = before;
  const auto outside = make_values(rule, 0, 4, bytes);
  EXPECT_EQ(!outside, fits) << name_of(rule.from) << " to " << name_of(rule.to) << " + " << intercept;
  EXPECT_TRUE(bytes == (fits ? bytes_of(truth) : before));
  if (outside) {
    EXPECT_FALSE(outside->value >= static_cast<double>(std::numeric_limits<To>::lowest()) &&
                 outside->value <= static_cast<double>(std::numeric_limits<To>::max()));
  }
}

template <class From>
void from_type() {
  for (const double intercept :
       {-3e9, -65536.0, -32769.0, -32768.0, -1024.0, -1.0, 1.0, 1024.0, 32767.0, 32768.0, 7e4, 3e9}) {
    expect_exact_or_refused<From, std::int16_t>(intercept);
    expect_exact_or_refused<From, std::uint16_t>(intercept);
    expect_exact_or_refused<From, std::int32_t>(intercept);
    expect_exact_or_refused<From, std::uint32_t>(intercept);
    for (const double slope : {2.0, -1.0, 0.0, 100.0}) {
      expect_exact_or_refused<From, std::int16_t>(intercept, slope);
      expect_exact_or_refused<From, std::uint32_t>(intercept, slope);
    }
  }
}

TEST(ValueRule, IntegersBecomeIntegersExactlyOrAreRefused) {
  from_type<std::uint8_t>();
  from_type<std::int8_t>();
  from_type<std::uint16_t>();
  from_type<std::int16_t>();
  from_type<std::uint32_t>();
  from_type<std::int32_t>();
}

TEST(ValueRule, FloatsAreRoundedOnce) {
  std::vector<std::byte> bytes = bytes_of(std::vector<std::int16_t>{-5, 3, 32767});
  ASSERT_FALSE(make_values({SampleType::int16, SampleType::float32, {0.1}, {0.3}}, 0, 3, bytes));
  EXPECT_TRUE(bytes == bytes_of(std::vector<float>{static_cast<float>(0.1 * -5 + 0.3),
                                                   static_cast<float>(0.1 * 3 + 0.3),
                                                   static_cast<float>(0.1 * 32767 + 0.3)}));
  bytes = bytes_of(std::vector<float>{1.5F, INFINITY, -0.0F});
  ASSERT_FALSE(make_values({SampleType::float32, SampleType::float32, {2}, {1}}, 0, 3, bytes));
  EXPECT_TRUE(bytes == bytes_of(std::vector<float>{4, INFINITY, 1}));
}

TEST(ValueRule, SlicesHaveNumbersOfTheirOwn) {
  std::vector<std::byte> bytes = bytes_of(std::vector<std::uint8_t>{1, 2, 3, 4});
  const ValueRule rule{SampleType::uint8, SampleType::float32, {9, 1, 10}, {9, 0, 0.5}};
  ASSERT_FALSE(make_values(rule, 1, 2, bytes));  // slices 1 and 2
  EXPECT_TRUE(bytes == bytes_of(std::vector<float>{1, 2, 30.5F, 40.5F}));
}

TEST(ValueRule, WithoutARuleSamplesStay) {
  const auto before = bytes_of(std::vector<std::uint8_t>{1, 2, 3, 4});
  auto bytes = before;
  const ValueRule none{SampleType::uint8, SampleType::uint8};
  EXPECT_TRUE(none.changes_nothing());
  ASSERT_FALSE(make_values(none, 0, 4, bytes));
  EXPECT_TRUE(bytes == before);
}

}  // namespace
}  // namespace tagrid
