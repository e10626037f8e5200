#include "stages/bound/bounds.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>

namespace tagrid {
namespace {

TEST(Quantizer, LeavesEveryDifferenceWithinTheBound) {
  for (const std::int64_t bound : {0, 1, 2, 5, 127, 128, 1000, 32767, 65534, 65535}) {
    const Quantizer quantizer(bound);
    for (std::int32_t difference = -65535; difference <= 65535; ++difference) {
      const std::int64_t restored = quantizer(difference) * (2 * bound + 1);
      ASSERT_LE(std::abs(restored - difference), bound) << difference;
    }
  }
}

TEST(Quantizer, OfABoundBeyondTheRangeIsThatOfTheRange) {
  const auto [inactive, active] = quantizers({std::int64_t{1} << 40, 70000});
  EXPECT_EQ(inactive.error, 65535);
  EXPECT_EQ(active.error, 65535);
}

TEST(Quantizer, OfActivePointsIsThatOfTheOthersWithoutABoundOfTheirOwn) {
  EXPECT_EQ(quantizers({7, -1})[1].error, 7);
  EXPECT_EQ(quantizers({7, 0})[1].error, 0);
}

TEST(IntegerBound, IsInWholeUnitsAndNotBeyondTheRangeOfTheType) {
  EXPECT_EQ(integer_bound<std::int16_t>(2.9), 2);
  EXPECT_EQ(integer_bound<std::int16_t>(1e300), 65535);
  EXPECT_EQ(integer_bound<std::uint8_t>(1e300), 255);
  EXPECT_EQ(integer_bound<std::uint8_t>(-1), -1);
}

TEST(Bound, IsAFiniteNumberFromZero) {
  EXPECT_TRUE(is_bound(0));
  EXPECT_TRUE(is_bound(1e300));
  EXPECT_FALSE(is_bound(-1));
  EXPECT_FALSE(is_bound(std::numeric_limits<double>::infinity()));
  EXPECT_FALSE(is_bound(std::numeric_limits<double>::quiet_NaN()));
}

}  // namespace
}  // namespace tagrid
