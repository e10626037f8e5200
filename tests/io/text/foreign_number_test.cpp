#include "io/text/foreign_number.h"

#include <gtest/gtest.h>

#include <limits>

namespace tagrid {
namespace {

TEST(ForeignNumbers, AnAbsentFieldIsNotAnEmptyOne) {
  EXPECT_TRUE(foreign_number(std::nullopt).is_absent());
  EXPECT_EQ(remark_on(foreign_number(std::nullopt), "Slope", ""), "");
  EXPECT_TRUE(foreign_number("").is_unreadable());
  EXPECT_TRUE(foreign_number("   ").is_unreadable());
  EXPECT_EQ(remark_on(foreign_number("  "), "Slope", "it is taken as 1"), "Slope is empty; it is taken as 1");
}

TEST(ForeignNumbers, NumbersMayHaveBlanksAndZerosAround) {
  EXPECT_EQ(foreign_number(" -1.5e3 ").value_or(0), -1500);
  EXPECT_EQ(foreign_number("+2").value_or(0), 2);
  EXPECT_EQ(foreign_number(std::string_view("0.25\0\0\0", 7)).value_or(0), 0.25);
  EXPECT_EQ(remark_on(foreign_number("0.25"), "Slope", ""), "");
}

TEST(ForeignNumbers, ADecimalCommaIsReadAndReported) {
  for (const auto& [text, value] : {std::pair("2,50", 2.5),
                                    {"-102,5", -102.5},
                                    {"0,125", 0.125},
                                    {"1,0e-3", 1e-3},
                                    {"1234,567", 1234.567}}) {
    const ForeignNumber number = foreign_number(text);
    EXPECT_EQ(number.value_or(0), value) << text;
    EXPECT_TRUE(number.decimal_comma) << text;
  }
  EXPECT_EQ(remark_on(foreign_number("2,50"), "Rescale Slope", ""),
            "Rescale Slope is \"2,50\", with a decimal comma; it is read as 2.5");
}

TEST(ForeignNumbers, ACommaThatMaySeparateThousandsIsUnreadable) {
  for (const char* text : {"1,024", "-12,500", "1,024,000", "1.024,5", "1,024.5", ",5", "5,"})
    EXPECT_TRUE(foreign_number(text).is_unreadable()) << text;
}

TEST(ForeignNumbers, WhatIsNotFiniteOrNotANumberIsUnreadable) {
  for (const char* text : {"inf", "-inf", "nan", "NaN", "0.5 mm", "1\\2", "abc", "1e999", "0x10", "+-5",
                           "-+5", "--5", "++5", "+ 5", "- 5", "+", "-", "+-2,5"})
    EXPECT_TRUE(foreign_number(text).is_unreadable()) << text;
  EXPECT_TRUE(foreign_number(std::numeric_limits<double>::quiet_NaN()).is_unreadable());
  EXPECT_TRUE(foreign_number(-std::numeric_limits<double>::infinity()).is_unreadable());
  EXPECT_EQ(foreign_number(-2.5).value_or(0), -2.5);
  EXPECT_EQ(remark_on(foreign_number("abc"), "Slope", "it is taken as 1"),
            "Slope is \"abc\", which is not a number; it is taken as 1");
}

}  // namespace
}  // namespace tagrid
