// Signed integers of every size as binary events.
#include "stages/adaptive_integer.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>
#include <vector>

#include "stages/range_coder.h"

namespace tagrid {
namespace {

std::vector<std::uint8_t> encoded(const std::vector<std::int64_t>& values) {
  std::vector<std::uint8_t> bytes;
  RangeEncoder coder(bytes);
  AdaptiveInteger model;
  for (const std::int64_t v : values) model.code(coder, v);
  coder.finish();
  return bytes;
}

void expect_round_trip(const std::vector<std::int64_t>& values) {
  const auto bytes = encoded(values);
  RangeDecoder coder(bytes);
  AdaptiveInteger model;
  for (const std::int64_t v : values) ASSERT_EQ(model.code(coder, 0), v);
  ASSERT_TRUE(coder.finished());
}

TEST(AdaptiveInteger, CodesTheNeighboursOfEveryPowerOfTwo) {
  std::vector<std::int64_t> values;
  for (int bit = 0; bit <= 62; ++bit)
    for (const std::int64_t step : {-1, 0, 1})
      for (const std::int64_t sign : {-1, 1}) values.push_back(sign * ((std::int64_t{1} << bit) + step));
  values.push_back(std::numeric_limits<std::int64_t>::max());
  values.push_back(-std::numeric_limits<std::int64_t>::max());
  expect_round_trip(values);
}

RC_GTEST_PROP(AdaptiveInteger, RoundTripIsExact,
              (const std::vector<std::int32_t>& small, std::uint64_t large)) {
  std::vector<std::int64_t> values(small.begin(), small.end());
  values.push_back(static_cast<std::int64_t>(large >> 2));
  values.push_back(-static_cast<std::int64_t>(large >> 2));
  expect_round_trip(values);
}

TEST(AdaptiveInteger, LearnsWhatIsFrequent) {
  EXPECT_LT(encoded(std::vector<std::int64_t>(10000, 0)).size(), 200U);
  EXPECT_LT(encoded(std::vector<std::int64_t>(10000, -5)).size(), 500U);
}

RC_GTEST_PROP(AdaptiveInteger, AnyBytesDecodeToSomeIntegers, (const std::vector<std::uint8_t>& bytes)) {
  RangeDecoder coder(bytes);
  AdaptiveInteger model;
  for (int i = 0; i < 200; ++i) {
    const std::int64_t v = model.code(coder, 0);
    RC_ASSERT(v != std::numeric_limits<std::int64_t>::min());
  }
}

}  // namespace
}  // namespace tagrid
