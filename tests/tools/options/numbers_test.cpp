#include "tools/options/numbers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace tagrid {
namespace {

TEST(Numbers, WholeNumbersAreDecimal) {
  EXPECT_EQ(whole_number<int>("020"), 20);
  EXPECT_EQ(whole_number<int>("+3"), 3);
  EXPECT_EQ(whole_number<int>("-3"), -3);
  EXPECT_EQ(whole_number<std::int64_t>("9223372036854775807"), std::numeric_limits<std::int64_t>::max());
  for (const char* text : {"", "+", "-", "+-3", "0x10", "1.0", "1e3", " 1", "1 ", "1,", "99999999999"})
    EXPECT_FALSE(whole_number<int>(text)) << text;
  EXPECT_FALSE(whole_number<std::uint64_t>("-1"));
}

TEST(Numbers, FiniteNumbersAreDecimalAndFinite) {
  EXPECT_EQ(finite_number("2"), 2.0);
  EXPECT_EQ(finite_number("-.5"), -0.5);
  EXPECT_EQ(finite_number("+1e3"), 1000.0);
  EXPECT_FALSE(std::signbit(*finite_number("-0")));
  for (const char* text : {"", "nan", "inf", "-inf", "1e999", "0x1p3", "1,5", "1 ", "+-1", "1e", "--1"})
    EXPECT_FALSE(finite_number(text)) << text;
}

TEST(Numbers, BytesAreCountedInPowersOf1024) {
  EXPECT_EQ(byte_count("12"), 12U);
  EXPECT_EQ(byte_count("3K"), 3072U);
  EXPECT_EQ(byte_count("2M"), 2097152U);
  EXPECT_EQ(byte_count("1G"), 1073741824U);
  EXPECT_EQ(byte_count("3T"), std::uint64_t{3} << 40);
  EXPECT_EQ(byte_count("2MiB"), 2097152U);
  EXPECT_EQ(byte_count("17179869183G"), std::uint64_t{17179869183} << 30);
  EXPECT_EQ(byte_count("+2MB"), 2097152U);
  EXPECT_EQ(byte_count("3k"), 3072U);
  EXPECT_EQ(byte_count("1.5G"), 1610612736U);
  EXPECT_EQ(byte_count("0.3KiB"), 307U);
  for (const char* text :
       {"", "K", "-1", "iB", "12iB", "12B", "MB", "1.5", "-1.5G", ".G", "1.5.5G", "1MiBB", "1GM", "1e3G",
        "1.5e3G", "nanG", "17179869184G", "17179869184.5G", "18446744073709551616"})
    EXPECT_FALSE(byte_count(text)) << text;
}

TEST(Numbers, SizesAreThree) {
  EXPECT_EQ(three_sizes("1,2147483648,3"), (Index3{1, std::int64_t{1} << 31, 3}));
  for (const char* text : {"", "1", "1,2", "1,2,", ",1,2", "1,,2,3", "1,2,3,", "1,2,3,4", "0,1,1", "1,1,-1",
                           "1,1,2147483649", "1, 2,3", "1;2;3"})
    EXPECT_FALSE(three_sizes(text)) << text;
}

TEST(Numbers, DistancesAreThreeAndPositive) {
  EXPECT_EQ(three_distances("0.5,1,1e3"), (std::array<double, 3>{0.5, 1, 1000}));
  for (const char* text : {"", "1,1", "1,0,1", "1,-1,1", "1,nan,1", "1,1,1e301", "1,1,1,1"})
    EXPECT_FALSE(three_distances(text)) << text;
}

TEST(Numbers, ARangeHasTwoEnds) {
  EXPECT_EQ(value_range("-1024:3072"), (std::pair{-1024.0, 3072.0}));
  for (const char* text : {"", ":", "1", "1:", ":1", "1:2:3", "a:1", "0:inf"})
    EXPECT_FALSE(value_range(text)) << text;
}

}  // namespace
}  // namespace tagrid
