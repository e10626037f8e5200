#include "io/text/numbered_names.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "io/text/natural_order.h"

namespace tagrid {
namespace {

using testing::ElementsAre;

TEST(NaturalOrder, CountsAsPeopleDo) {
  const std::vector<std::string> sorted = {"",
                                           "1",
                                           "2",
                                           "10",
                                           "a",
                                           "a1",
                                           "a01b",
                                           "a2",
                                           "a9b9",
                                           "a9b10",
                                           "a10",
                                           "a10000000000000000000000",
                                           "a10000000000000000000001",
                                           "b"};
  for (std::size_t i = 0; i < sorted.size(); ++i)
    for (std::size_t j = 0; j < sorted.size(); ++j)
      EXPECT_EQ(comes_before(sorted[i], sorted[j]), i < j) << sorted[i] << " " << sorted[j];
}

TEST(NaturalOrder, IsAnOrderOfAllTexts) {
  std::mt19937 random(1);
  std::vector<std::string> texts;
  for (int i = 0; i < 60; ++i) {
    std::string text;
    for (std::size_t n = random() % 5; n > 0; --n) text += "01a9-"[random() % 5];
    texts.push_back(text);
  }
  for (const std::string& a : texts)
    for (const std::string& b : texts) {
      EXPECT_EQ(comes_before(a, b) + comes_before(b, a) + (a == b), 1) << a << " " << b;
      for (const std::string& c : texts) {
        if (comes_before(a, b) && comes_before(b, c)) {
          EXPECT_TRUE(comes_before(a, c)) << a << " " << b << " " << c;
        }
      }
    }
}

TEST(NumberedFiles, TwoWithTheSameNumberAreNamedAndAreNoGap) {
  const auto series = numbered_files({"d/a1.tif", "d/a01.tif", "d/a2.tif"});
  ASSERT_EQ(series.size(), 1u);
  ASSERT_TRUE(series[0].same);
  EXPECT_FALSE(series[0].gap);
  EXPECT_THAT(same_in_words(series[0]), testing::HasSubstr("have the same number"));
  EXPECT_FALSE(numbered_files({"a9.tif", "a10.tif", "a90.tif"})[0].same);
  EXPECT_TRUE(numbered_files({"a0.tif", "a00.tif"})[0].same);
}

TEST(NumberedFiles, AreASeriesByTheirLastNumber) {
  const auto series = numbered_files({"d/s10.tif", "d/s2.tif", "d/s1.tif", "d/s3.tif"});
  ASSERT_EQ(series.size(), 1u);
  EXPECT_EQ(series[0].pattern, "s#.tif");
  EXPECT_THAT(series[0].paths, ElementsAre("d/s1.tif", "d/s2.tif", "d/s3.tif", "d/s10.tif"));
  ASSERT_TRUE(series[0].gap);
  EXPECT_EQ(*series[0].gap, std::pair(std::string("d/s3.tif"), std::string("d/s10.tif")));
}

TEST(NumberedFiles, ConstantNumbersBelongToTheName) {
  const auto series = numbered_files(
      {"d/2019_a001.tif", "d/2019_a002.tif", "d/2019_b001.tif", "d/2019_b002.tif", "d/note.tif"});
  ASSERT_EQ(series.size(), 3u);
  EXPECT_EQ(series[0].pattern, "2019_a#.tif");
  EXPECT_EQ(series[1].pattern, "2019_b#.tif");
  EXPECT_EQ(series[2].pattern, "note.tif");
  for (const NumberedFiles& one : series) EXPECT_FALSE(one.gap);
}

TEST(NumberedFiles, EqualStepsAreNoGap) {
  const auto even = numbered_files({"s0.tif", "s5.tif", "s10.tif", "s15.tif"});
  ASSERT_EQ(even.size(), 1u);
  EXPECT_FALSE(even[0].gap);
  const auto uneven = numbered_files({"s0.tif", "s5.tif", "s15.tif", "s20.tif"});
  ASSERT_TRUE(uneven[0].gap);
  EXPECT_EQ(uneven[0].gap->first, "s5.tif");
}

TEST(NumberedFiles, AllNumbersThatAreMissingAreSaid) {
  EXPECT_EQ(numbered_files({"s1.tif", "s2.tif", "s4.tif", "s08.tif"})[0].missing, "3, 5 to 7");
  EXPECT_EQ(numbered_files({"s0.tif", "s5.tif", "s15.tif", "s30.tif"})[0].missing, "10, 20 to 25");
  EXPECT_EQ(numbered_files({"s1.tif", "s2.tif", "s3.tif"})[0].missing, "");
  EXPECT_EQ(gap_in_words(numbered_files({"d/s1.tif", "d/s2.tif", "d/s4.tif"})[0]),
            "between s2.tif and s4.tif, slices are missing according to their numbers: 3");
  EXPECT_EQ(number_pattern("a12b003.tif"), "a#b#.tif");
}

TEST(NumberedFiles, AHashInANameIsNoNumber) {
  const auto series = numbered_files({"d/a0.tif", "d/a#.tif", "d/a1.tif", "d/a2.tif"});
  ASSERT_EQ(series.size(), 2u);
  for (const NumberedFiles& one : series) {
    EXPECT_EQ(one.pattern, "a#.tif");
    if (one.paths.size() == 1) {
      EXPECT_THAT(one.paths, ElementsAre("d/a#.tif"));
    } else {
      EXPECT_THAT(one.paths, ElementsAre("d/a0.tif", "d/a1.tif", "d/a2.tif"));
    }
    EXPECT_FALSE(one.gap || one.same);
  }
  EXPECT_EQ(numbered_files({"1#2", "1#1", "##1", "##2", "1##", "2##"}).size(), 3u);
}

TEST(NumberedFiles, NumbersBeyondAllTypesAreNumbers) {
  const auto series = numbered_files({"s99999999999999999999999.tif", "s100000000000000000000000.tif"});
  ASSERT_EQ(series.size(), 1u);
  EXPECT_EQ(series[0].paths.front(), "s99999999999999999999999.tif");
}

}  // namespace
}  // namespace tagrid
