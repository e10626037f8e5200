// Pictures: text, colors, lengths and panels.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "stages/picture/grey_window.h"
#include "stages/picture/image.h"
#include "stages/picture/panel.h"

namespace tagrid {
namespace {

// Text, colours and lengths.

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
PanelAxis any_axis() {
  return {0, *rc::gen::inRange<std::int64_t>(1, 5000), *rc::gen::inRange(1, 1000),
          *rc::gen::arbitrary<bool>(), *rc::gen::element<std::int64_t>(0, 1, 700)};
}

RC_GTEST_PROP(PanelAxes, EverySampleThatIsReadHasAPixelIfThereAreEnough, ()) {
  const PanelAxis axis = any_axis();
  std::set<std::int64_t> shown;
  for (int pixel = 0; pixel < axis.pixels; ++pixel) {
    RC_ASSERT(axis.number(pixel) >= 0 && axis.number(pixel) < axis.count());
    shown.insert(axis.number(pixel));
  }
  if (axis.samples <= axis.pixels) RC_ASSERT(static_cast<std::int64_t>(shown.size()) == axis.samples);
  RC_ASSERT(axis.count() < 2 * axis.pixels || axis.step() == 1);
}

RC_GTEST_PROP(PanelAxes, APixelShowsTheSampleNearestToItsMiddle, ()) {
  const PanelAxis axis = any_axis();
  for (int pixel = 0; pixel < axis.pixels; ++pixel) {
    const int from_first = axis.reversed ? axis.pixels - 1 - pixel : pixel;
    const double middle = (from_first + 0.5) * static_cast<double>(axis.samples) / axis.pixels - 0.5;
    const auto sample = static_cast<double>(axis.number(pixel) * axis.step());
    RC_ASSERT(std::abs(sample - middle) < 0.51 + static_cast<double>(axis.step() - 1));
    const double place =
        static_cast<double>(axis.place(pixel)) / PanelAxis::parts - static_cast<double>(axis.first);
    RC_ASSERT(std::abs(place - std::clamp(middle, 0.0, static_cast<double>(axis.samples - 1))) <
              1.01 / PanelAxis::parts);
  }
}

RC_GTEST_PROP(PanelAxes, ThePixelOfASampleIsAtItsMiddle, ()) {
  const PanelAxis axis = any_axis();
  for (std::int64_t sample = axis.first; sample < axis.first + axis.samples; ++sample) {
    const int pixel = axis.pixel_of(sample);
    RC_ASSERT(pixel >= 0 && pixel < axis.pixels);
    const double from_first = axis.reversed ? axis.pixels - 1 - pixel : pixel,
                 middle = (static_cast<double>(sample - axis.first) + 0.5) * axis.pixels /
                          static_cast<double>(axis.samples);
    RC_ASSERT(middle >= from_first && middle < from_first + 1);
  }
}

RC_GTEST_PROP(Panels, ADetailIsAroundASampleInTheSameShapeWithTwoPixelsASample, ()) {
  const auto length = [] { return *rc::gen::inRange<std::int64_t>(1, 5000); };
  const Index3 dims{length(), length(), length()};
  const Panel whole = panel_of(dims, {1, 1, *rc::gen::element(0.3, 1.0, 5.0)}, 2, 0,
                               *rc::gen::inRange(50, 1000), *rc::gen::element(1, 24));
  const Index3 at{*rc::gen::inRange<std::int64_t>(0, dims.x), *rc::gen::inRange<std::int64_t>(0, dims.y), 0};
  const Panel detail = detail_of(whole, at);
  RC_ASSERT(!detail.leaves_out());
  for (const auto& [a, b] : {std::pair(whole.across, detail.across), {whole.down, detail.down}}) {
    RC_ASSERT(b.pixels == a.pixels && b.axis == a.axis && b.samples >= 1);
    RC_ASSERT(2 * b.samples <= b.pixels || b.samples == 1);
    const std::int64_t end = b.first + b.samples, before = at[a.axis] - b.first, after = end - 1 - at[a.axis];
    RC_ASSERT(b.first >= 0 && end <= a.samples && before >= 0 && after >= 0);
    RC_ASSERT(std::abs(before - after) <= 1 || b.first == 0 || end == a.samples);
  }
  if (!whole.to_scale) return;
  // A side of few samples cannot have quite the same part of them.
  const double across =
                   static_cast<double>(detail.across.samples) / static_cast<double>(whole.across.samples),
               down = static_cast<double>(detail.down.samples) / static_cast<double>(whole.down.samples);
  RC_ASSERT(std::abs(across - down) <=
            1.0 / static_cast<double>(whole.across.samples) + 1.0 / static_cast<double>(whole.down.samples));
}

TEST(PanelAxes, AxesOfTheLargestSizeFit) {
  const PanelAxis axis{0, std::int64_t{1} << 31, 780, false};
  EXPECT_LT(axis.count(), 2 * 780);
  EXPECT_LT(axis.number(779), axis.count());
  EXPECT_GT(axis.place(779), axis.place(0));
}

TEST(Panels, HaveTheShapeOfTheirSlice) {
  const Panel z = panel_of({100, 50, 10}, {0.5, 0.5, 2.5}, 2, 3, 800, 20);
  EXPECT_EQ(z.across.pixels, 800);
  EXPECT_EQ(z.down.pixels, 400);
  EXPECT_FALSE(z.down.reversed);
  const Panel y = panel_of({100, 50, 10}, {0.5, 0.5, 2.5}, 1, 3, 800, 20);
  EXPECT_EQ(y.across.pixels, 800);
  EXPECT_EQ(y.down.pixels, 400);  // 25 of 50
  EXPECT_TRUE(y.down.reversed);
  EXPECT_TRUE(y.to_scale);
}

TEST(Panels, OfOneVolumeHaveOneScaleIfNoneBecomesSmall) {
  const Index3 dims{100, 80, 30};
  const auto pixels_of_sample = [&](int axis) {
    const Panel p = panel_of(dims, {1, 1, 1}, axis, 0, 800, 20);
    return std::pair(p.across.pixels / static_cast<double>(p.across.samples),
                     p.down.pixels / static_cast<double>(p.down.samples));
  };
  for (const int axis : {0, 1, 2}) EXPECT_EQ(pixels_of_sample(axis), (std::pair{8.0, 8.0}));
  // In the scale of 1000 slices, the other panel would be a stamp.
  EXPECT_EQ(panel_of({100, 80, 1000}, {1, 1, 1}, 2, 0, 800, 20).across.pixels, 800);
}

TEST(Panels, OfASingleSliceAreThinStripsThatSayTheyAreNotToScale) {
  const Panel y = panel_of({100, 50, 1}, {1, 1, 1}, 1, 3, 800, 24);
  EXPECT_EQ(y.down.pixels, 24);
  EXPECT_FALSE(y.to_scale);
}

TEST(Panels, AnySpacingGivesAPanel) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(),
                   inf = std::numeric_limits<double>::infinity();
  for (const double spacing : {nan, 0.0, inf, -inf, -2.0, 5e-324, 1.7e308})
    for (const int axis : {0, 1, 2}) {
      const Panel p = panel_of({7, 8, 9}, {1, spacing, spacing}, axis, 0, 800, 24);
      for (const PanelAxis& a : {p.across, p.down}) {
        EXPECT_GE(a.pixels, 24);
        EXPECT_LE(a.pixels, 800);
      }
    }
}

constexpr double inf = std::numeric_limits<double>::infinity(),
                 nan = std::numeric_limits<double>::quiet_NaN(), most = std::numeric_limits<double>::max();

GreyWindow window(std::vector<double> values) { return window_of(values); }

TEST(GreyWindows, LeaveOutHalfAPercentAtEachEnd) {
  std::vector<double> values;
  for (int i = 0; i < 1000; ++i) values.push_back(i);
  std::ranges::shuffle(values, std::mt19937(1));
  const GreyWindow w = window(values);
  EXPECT_EQ(w.low, 5);
  EXPECT_EQ(w.high, 994);
}

TEST(GreyWindows, DoNotCountPaddingOrWhatIsNotFinite) {
  std::vector<double> values;
  for (int i = 0; i < 1000; ++i) values.push_back(i);
  for (int i = 0; i < 1001; ++i) values.push_back(-2000);
  for (int i = 0; i < 3000; ++i) values.insert(values.end(), {nan, inf, -inf});
  EXPECT_EQ(window(values).low, 5);
  values.erase(values.begin() + 1000, values.begin() + 1002);  // now it is not more than half
  EXPECT_EQ(window(values).low, -2000);
}

TEST(GreyWindows, OfAMaskOrLabelsShowTheBackgroundToo) {
  std::vector<double> mask(1000, 0.0), labels = mask;
  std::fill_n(mask.begin() + 3, 100, 255.0);
  GreyWindow window = window_of(mask);
  EXPECT_EQ(window.low, 0);
  EXPECT_EQ(window.high, 255);
  for (std::size_t i = 0; i < 300; ++i) labels[i] = static_cast<double>(1 + i % 3);
  window = window_of(labels);
  EXPECT_EQ(window.low, 0);
  EXPECT_EQ(window.high, 3);
}

TEST(GreyWindows, ArePossibleForAnyValues) {
  const auto expect_window = [](std::vector<double> values) {
    const GreyWindow w = window(values);
    RC_ASSERT(w.low < w.high);
    RC_ASSERT(std::isfinite(w.low) && std::isfinite(w.high));
    for (const double value : values) w.grey(value);
  };
  for (const auto& values : std::vector<std::vector<double>>{{},
                                                             {7},
                                                             {7, 7, 7},
                                                             {nan},
                                                             {inf, -inf},
                                                             {most},
                                                             {-most},
                                                             {-most, most},
                                                             {most, most, 1},
                                                             {0, -0.0}})
    expect_window(values);
  rc::check(expect_window);
}

TEST(GreyWindows, RunFromBlackToWhite) {
  const GreyWindow w{-1000, 1000};
  EXPECT_EQ(w.grey(-1000), 0);
  EXPECT_EQ(w.grey(-inf), 0);
  EXPECT_EQ(w.grey(0), 128);
  EXPECT_EQ(w.grey(1000), 255);
  EXPECT_EQ(w.grey(inf), 255);
  EXPECT_EQ(w.grey(nan), std::nullopt);
  EXPECT_EQ((GreyWindow{-most, most}.grey(0)), 128);
}

}  // namespace
}  // namespace tagrid
