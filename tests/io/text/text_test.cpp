// Text of others: numbers, names with numbers, and what may be printed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "io/text/foreign_number.h"
#include "io/text/numbered_names.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

TEST(Letters, OfAnyScriptBecomeSmall) {
  EXPECT_EQ(lower_case_of_unicode("MÜLLER^Öl 7"), "müller^öl 7");
  EXPECT_EQ(lower_case_of_unicode("ЛЮК Σ ĦΙ 山田 ﾔﾏ 😀 Ａ"), "люк σ ħι 山田 ﾔﾏ 😀 ａ");
  EXPECT_EQ(lower_case_of_unicode(std::string_view("A\0B", 3)), std::string_view("a\0b", 3));
  EXPECT_EQ(lower_case_of_unicode("M\xDCLLER"), "m\xDCller");  // not UTF-8
  EXPECT_EQ(lower_case("MÜLLER"), "mÜller");
}

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
TEST(ForeignNumbers, AreReadOrSaid) {
  EXPECT_TRUE(foreign_numbers(std::nullopt, 3).is_absent);
  EXPECT_EQ(remark_on(foreign_numbers(std::nullopt, 3), "spacing", "it is unknown"), "");
  const ForeignNumbers good = foreign_numbers(" 1 2.5  -3 ", 3);
  EXPECT_TRUE(good.are_numbers());
  EXPECT_EQ(good.values(), (std::vector<double>{1, 2.5, -3}));
  EXPECT_EQ(remark_on(good, "spacing", "it is unknown"), "");
  const ForeignNumbers commas = foreign_numbers("0,5 1 2,25", 3);
  EXPECT_EQ(commas.values(), (std::vector<double>{0.5, 1, 2.25}));
  EXPECT_EQ(remark_on(commas, "spacing", ""),
            "spacing \"0,5 1 2,25\" has decimal commas, which are read as points");
  EXPECT_EQ(remark_on(foreign_numbers("1 2", 3), "spacing", "it is unknown"),
            "spacing \"1 2\" must be 3 numbers; it is unknown");
  EXPECT_EQ(remark_on(foreign_numbers("1 inf 3", 3), "spacing", "it is unknown"),
            "spacing \"1 inf 3\": \"inf\" is not a number; it is unknown");
  EXPECT_EQ(remark_on(foreign_numbers(" ", 3), "spacing", "it is unknown"),
            "spacing is empty; it is unknown");
  for (const char* text : {"1 2", "1 inf 3", "", "0.5,0.5,1"})
    EXPECT_FALSE(foreign_numbers(text, 3).are_numbers()) << text;
}

// What is safe to print, and what JSON can hold.

TEST(Printable, TextStaysAsItIs) {
  for (const std::string text : {"", "scan 1.nrrd",
                                 "Sch\xC3\xA4"
                                 "del.tag",
                                 "\xE2\x82\xAC", "\xF0\x9F\xA9\xBB", "a\\b"})
    EXPECT_EQ(printable(text), text);
}

TEST(Printable, ControlCharactersAreEscaped) {
  EXPECT_EQ(printable("a\x1b[31mb"), "a\\x1b[31mb");
  EXPECT_EQ(printable("a\nb\tc\rd\x7f"), "a\\nb\\tc\\rd\\x7f");
  EXPECT_EQ(printable(std::string("a\0b", 3)), "a\\x00b");
  EXPECT_EQ(printable("\xC2\x9B"
                      "31m"),
            "\\xc2\\x9b31m")
      << "a control character of two bytes";
  EXPECT_EQ(printable("\xE2\x80\xAE"), "\\xe2\\x80\\xae") << "turns the direction of what follows";
}

TEST(Printable, BytesThatAreNoUtf8AreEscaped) {
  EXPECT_EQ(printable("\xff"), "\\xff");
  EXPECT_EQ(printable("\x9b"
                      "31m"),
            "\\x9b31m");
  EXPECT_EQ(printable("\xC3"), "\\xc3") << "cut off";
  EXPECT_EQ(printable("\xC0\xAF"), "\\xc0\\xaf") << "longer than necessary";
  EXPECT_EQ(printable("\xED\xA0\x80"), "\\xed\\xa0\\x80") << "half a character of UTF-16";
  EXPECT_EQ(printable("\xF4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80") << "beyond all characters";
  EXPECT_EQ(printable("\xE2\x82"
                      "a"),
            "\\xe2\\x82a");
}

TEST(NamesInJson, ComeBackByteForByteAndAreUtf8) {
  EXPECT_EQ(text_of_name("x\xff.nrrd"),
            "x\xEF\xBF\xBD"
            "FF.nrrd");
  std::string every;
  for (int byte = 1; byte < 256; ++byte) every += static_cast<char>(byte);
  for (const std::string& name : {std::string(),
                                  std::string("Sch\xC3\xA4"
                                              "del \\t\n.tag"),
                                  every, std::string("\xEF\xBF\xBD"),
                                  std::string("\xEF\xBF\xBD"
                                              "FF"),
                                  std::string("\xED\xA0\x80\xff")}) {
    EXPECT_EQ(name_of_text(text_of_name(name)), name);
    EXPECT_EQ(nlohmann::json::parse(nlohmann::json(text_of_name(name)).dump()), text_of_name(name));
  }
  EXPECT_NE(text_of_name("\xff"), text_of_name("\xfe"));
  for (const char* text : {"a", "\xEF\xBF\xBD", "\xEF\xBF\xBD\x46", "\xEF\xBF\xBDgg"})
    EXPECT_EQ(name_of_text(text), text) << "as of older records";
}

// Texts of files as messages show them.

TEST(QuotedText, ShowsEveryCharacterThatCanBeShown) {
  EXPECT_EQ(quoted(std::string_view("\xc2\xb5m \xe2\x84\xab")), "\"\xc2\xb5m \xe2\x84\xab\"");
  EXPECT_EQ(quoted(std::string_view("a\x1b[31m\n\xb5m")), "\"a\\x1b[31m\\n\\xb5m\"")
      << "controls, and Latin-1";
}

TEST(QuotedText, IsCutBetweenCharacters) {
  const std::string front(59, 'a');
  EXPECT_EQ(quoted(std::string_view(front + "b")), "\"" + front + "b\"");
  EXPECT_EQ(quoted(std::string_view(front + "\xc2\xb5")), "\"" + front + "...\"");
  EXPECT_EQ(quoted(std::string_view(std::string(70, '\xb5'))).size(), 2 + 3 + 4 * 57U) << "no character";
}
using testing::ElementsAre;

TEST(Counted, OnlyOneIsSingular) {
  EXPECT_EQ(counted(0, "file"), "0 files");
  EXPECT_EQ(counted(1, "file"), "1 file");
  EXPECT_EQ(counted(2, "file"), "2 files");
}

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

TEST(NumberedFiles, PatternsThatMayBelongTogetherAreDoubted) {
  EXPECT_EQ(
      doubt_of_patterns({"s#.TIF", "s#.tif"}),
      "s#.TIF and s#.tif differ in upper and lower case only; if they are one volume, give its slices the "
      "same extension");
  EXPECT_EQ(
      doubt_of_patterns({"s1_T1200.tif", "s2_T1207.tif", "s3_T1214.tif"}),
      "s1_T1200.tif and 2 other files differ in several numbers; if they are slices of one volume, give "
      "them names, or links, that differ in one number only");
  EXPECT_EQ(doubt_of_patterns({"z-0.5mm.tif", "z-1.#mm.tif", "z0.#mm.tif"}),
            "z-0.5mm.tif and 2 others differ in numbers with a decimal point; if they are slices of one "
            "volume, give "
            "them names, or links, that differ in one whole number only");
  const std::vector<std::vector<std::string>> others = {
      {"a#.tif", "b#.tif"},
      {"v1.2_#.tif", "v1.3_#.tif", "v1.4_#.tif"},               // three versions
      {"head_0.5mm.nrrd", "head_1.0mm.nrrd", "head_2mm.nrrd"},  // three resolutions
      {"z1.0.tif", "z#.5.tif"},                                 // few
      {"1.2.7.#.tif", "1.2.8.#.tif", "1.2.9.#.tif"},            // names that are no positions
      {"scan1_#.tif", "scan2_#.tif", "scan3_#.tif"},            // three scans in a directory
      {"part1.tif", "part2.tif", "part3.tif"},                  // files of several slices
      {"2019_part1.tif", "2019_part2.tif", "2019_part3.tif"},   // the same, of one year
      {"s#.tif", "s003 (1).tif", "s003 - Copy.tif"},            // copies
      {"knee_1_2.tif", "knee_2_3.tif"},                         // two scans of one slice
      {"1.2.7-12345678", "1.2.8-12345679", "1.2.9-12345670"}};  // DICOM
  for (const auto& patterns : others) EXPECT_EQ(doubt_of_patterns(patterns), "") << patterns.front();
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
