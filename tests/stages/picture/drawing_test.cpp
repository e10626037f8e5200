// Text, colours and lengths.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "stages/picture/image.h"
#include "stages/picture/panel.h"
#include "stages/picture/text.h"

namespace tagrid {
namespace {

constexpr Colour black = {}, white = {255, 255, 255};

std::string drawn(const std::string& text, int scale = 1) {
  Image image(text_width(text, scale) + 1, text_height * scale, black);
  draw_text(image, 0, 0, text, scale, white);
  std::string pixels;
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) pixels += image.at(x, y) == white ? '#' : '.';
  return pixels;
}

TEST(Text, EveryCharacterLooksDifferent) {
  std::set<std::string> looks;
  for (char c = ' '; c <= '~'; ++c) looks.insert(drawn(std::string(1, c)));
  looks.insert(drawn("\xc3\xa4"));
  EXPECT_EQ(looks.size(), 96U);
}

TEST(Text, MicroIsDrawnWhicheverOfItsCharactersItIs) {
  EXPECT_EQ(drawn("\xc2\xb5m"), drawn("\xce\xbcm"));
  EXPECT_NE(drawn("\xc2\xb5m"), drawn("\xc3\xb6m"));
  EXPECT_NE(drawn("\xc2\xb5m"), drawn("um"));
  EXPECT_EQ(text_width("\xc2\xb5m", 1), text_width("um", 1));
}

TEST(Text, AnyBytesAreDrawn) {
  EXPECT_EQ(drawn("\xc3\xa4"), drawn("\xe2\x82\xac"));  // one box each
  EXPECT_EQ(drawn("\x01"), drawn("\xff"));
  rc::check([](const std::string& bytes) { drawn(bytes); });
}

TEST(Text, IsEnlargedByWholeNumbers) {
  EXPECT_EQ(text_width("abc", 1), 17);
  EXPECT_EQ(text_width("abc", 3), 51);
  Image small(17, text_height, black), large(51, 3 * text_height, black);
  draw_text(small, 0, 0, "agQ", 1, white);
  draw_text(large, 0, 0, "agQ", 3, white);
  for (int y = 0; y < large.height(); ++y)
    for (int x = 0; x < large.width(); ++x) EXPECT_EQ(large.at(x, y), small.at(x / 3, y / 3));
}

TEST(Image, WhatLiesOutsideIsLeftOut) {
  Image image(4, 3, black);
  image.fill(-5, -5, 100, 6, white);
  image.fill(3, 2, 9, 9, white);
  image.set(-1, 1, white);
  image.set(4, 1, white);
  int count = 0;
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 4; ++x) count += image.at(x, y) == white;
  EXPECT_EQ(count, 5);
}

TEST(LevelColours, BecomeLighterWithTheLevel) {
  for (const int deepest : {6, 9, 15, 24})
    for (int level = 1; level <= deepest; ++level) {
      const auto lightness = [&](int l) {
        const Colour c = colour_of_level(l, deepest);
        return 299 * c.red + 587 * c.green + 114 * c.blue;
      };
      EXPECT_GT(lightness(level), lightness(level - 1)) << level << " of " << deepest;
    }
}

TEST(RoundLengths, AreTheLongestOfTheirKind) {
  for (const auto& [length, round] : std::vector<std::pair<double, double>>{{1, 1},
                                                                            {1.99, 1},
                                                                            {2, 2},
                                                                            {4.9, 2},
                                                                            {5, 5},
                                                                            {9.9, 5},
                                                                            {10, 10},
                                                                            {260, 200},
                                                                            {0.1, 0.1},
                                                                            {0.26, 0.2},
                                                                            {0.0099, 0.005},
                                                                            {7e11, 5e11}})
    EXPECT_EQ(round_length(length), round) << length;
  EXPECT_GT(round_length(1e-300), 0);
  EXPECT_LE(round_length(1e300), 1e300);
}

}  // namespace
}  // namespace tagrid
