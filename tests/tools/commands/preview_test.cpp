// tagrid preview: the picture, and what is refused.
#include <fmt/format.h>

#include <cstring>
#include <limits>

#include "stages/picture/grey_window.h"
#include "stages/picture/image.h"
#include "tests/support/command_line.h"
#include "tests/support/png_reader.h"
#include "tests/support/points.h"
#include "tools/preview/sheet.h"

namespace tagrid {
namespace {

class PreviewCommand : public CommandLine {
 protected:
  PngPicture preview(const std::string& tag, const Arguments& more = {}) const {
    expect_ok(tagrid(with({"preview", tag, "-o", "a.png", "-f"}, more)));
    return png_of(content("a.png"));
  }

  struct Volume {
    Index3 dims;
    std::string samples;

    std::int16_t at(Index3 p) const {
      std::int16_t sample = 0;
      std::memcpy(&sample, samples.data() + 2 * Box::of_size(dims).offset(p), 2);
      return sample;
    }
  };
  Volume decoded(const std::string& tag, Index3 dims) const {
    return {dims, tagrid({"decode", tag, "-o", "-"}).out};
  }

  // The panels of a volume of which each sample has 1 mm.
  static PreviewContent panels(Index3 dims, std::array<std::int64_t, 3> slices, bool has_levels = true) {
    PreviewContent content;
    content.leaves.resize(has_levels ? 1 : 0);
    const PreviewWishes wishes;
    const int largest = has_levels ? wishes.largest : wishes.largest_of_three;
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      content.slices[a].panel = panel_of(dims, {1, 1, 1}, axis, slices[a], largest, wishes.least);
    }
    return content;
  }
  static void expect_grey(const PngPicture& picture, const Volume& volume, std::array<std::int64_t, 3> slices,
                          const GreyWindow& window, bool has_levels = true) {
    const PreviewContent content = panels(volume.dims, slices, has_levels);
    const SheetPlaces places = places_on_sheet(content);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Panel& p = content.slices[axis].panel;
      for (int v = 0; v < p.down.pixels; ++v)
        for (int u = 0; u < p.across.pixels; ++u) {
          Index3 sample;
          sample[p.axis] = p.slice;
          sample[p.across.axis] = p.across.number(u);
          sample[p.down.axis] = p.down.number(v);
          const int grey = *window.grey(volume.at(sample));
          ASSERT_EQ(picture.at(places.slices[axis].x + u, places.slices[axis].y + v),
                    (std::array{grey, grey, grey}));
        }
    }
  }
  void make_nrrd(const std::string& name, const std::string& fields, std::string_view samples) const {
    file(name,
         "NRRD0005\ndimension: 3\nencoding: raw\nendian: little\n" + fields + "\n" + std::string(samples));
  }
};

TEST_F(PreviewCommand, PixelsAreTheSamplesOfTheVolumeUnderTheWindow) {
  make_tag({"--max-error", "3"});
  const Volume volume = decoded("volume.tag", {52, 40, 36});
  PngPicture picture = preview("volume.tag", {"--window", "-900:600"});
  EXPECT_EQ(picture.width, 1600);
  expect_grey(picture, volume, {26, 20, 18}, {-900, 600});
  picture = preview("volume.tag", {"--window=-900:600", "--slice", "z=35", "--slice=x=0", "--slice", "z=7"});
  expect_grey(picture, volume, {0, 20, 7}, {-900, 600});
}

TEST_F(PreviewCommand, WithoutAStoredGridThreeSlicesFillTheSheet) {
  make_tag({"--grid", "derived"});
  const PngPicture picture = preview("volume.tag", {"--window", "-900:600"});
  EXPECT_EQ(picture.width, 1600);
  EXPECT_LT(picture.height, 800);
  expect_grey(picture, decoded("volume.tag", {52, 40, 36}), {26, 20, 18}, {-900, 600}, false);
}

TEST_F(PreviewCommand, WithoutAWindowItIsThatOfTheSamplesShown) {
  make_tag();
  works("preview volume.tag --json a.json");
  const auto json = json_of("a.json");
  const Volume volume = decoded("volume.tag", {52, 40, 36});
  std::vector<double> values;
  for (const PreviewSlice& slice : panels(volume.dims, {26, 20, 18}).slices) {
    Box box = Box::of_size(volume.dims);
    box.low[slice.panel.axis] = box.high[slice.panel.axis] = slice.panel.slice;
    for (const auto [x, y, z] : points_of(box)) values.push_back(volume.at({x, y, z}));
  }
  const GreyWindow window = window_of(values);
  EXPECT_EQ(json["settings"]["window"], (nlohmann::json{window.low, window.high}));
  EXPECT_EQ(json["settings"]["slices"], (nlohmann::json{{"x", 26}, {"y", 20}, {"z", 18}}));
  expect_grey(png_of(content("volume.png")), volume, {26, 20, 18}, window);
}

TEST_F(PreviewCommand, BytesAreTheSameForAnyThreadsAndOnStandardInputAndOutput) {
  make_tag({"--cube", "4"});
  works("preview volume.tag -T 1 -o a.png");
  works("preview volume.tag -T 4 -M 64M -o b.png");
  EXPECT_TRUE(content("a.png") == content("b.png"));
  EXPECT_TRUE(content("a.png") == tagrid({"preview", "volume.tag", "-o", "-"}).out);
  expect_ok(script("\"$TAGRID\" preview - -o c.png < volume.tag"));
  EXPECT_EQ(png_of(content("c.png")).height, png_of(content("a.png")).height);
}

// A constant volume has the grid of its root cubes alone, so that its panel of levels has few colours.
TEST_F(PreviewCommand, TheLegendHasTheColoursOfTheLevels) {
  make_nrrd("flat.nrrd", "type: int16\nsizes: 40 40 40\n", std::string(2 * 40 * 40 * 40, '\1'));
  works("encode flat.nrrd");
  const PngPicture picture = preview("flat.tag", {"--window", "1000:2000"});
  const PreviewContent content = panels({40, 40, 40}, {20, 20, 20});
  const SheetPlaces places = places_on_sheet(content);
  const auto rgb = [](Colour c) { return std::array<int, 3>{c.red, c.green, c.blue}; };
  // The samples are black, so that the colour of level 0 is darker by a share.
  const auto panel = picture.at(places.levels.x + 10, places.levels.y + 5);
  EXPECT_EQ(panel, rgb(mixed({}, colour_of_level(0, 15), 150)));
  // All colours of the legend are in the rows below the panel, from left to right.
  int level = 0;
  const int below = places.levels.y + content.slices[2].panel.down.pixels;
  for (int y = below; y < below + 70 && level < 16; ++y) {
    level = 0;
    for (int x = places.levels.x; x < picture.width && level < 16; ++x)
      if (picture.at(x, y) == rgb(colour_of_level(level, 15))) ++level;
  }
  EXPECT_EQ(level, 16);
}

TEST_F(PreviewCommand, AFrameShowsOfWhichPartOfALargeSliceTheLevelsAre) {
  constexpr Index3 dims{1700, 850, 3};
  std::string samples(static_cast<std::size_t>(Box::of_size(dims).count()), '\1');
  make_nrrd("large.nrrd", "type: uint8\nsizes: 1700 850 3\n", samples);
  works("encode large.nrrd");
  const PngPicture picture = preview("large.tag", {"--window", "0:1000"});
  const SheetPlaces places = places_on_sheet(panels(dims, {850, 425, 1}));
  // The samples are nearly black. Slices are of means, so that 111 of 1700 samples have seven pixels each; in
  // the whole slice they begin at pixel 364.
  const auto is_bright = [&](int u, int v) {
    return picture.at(places.slices[2].x + u, places.slices[2].y + v)[0] > 200;
  };
  for (int u = 0; u < 780; ++u) EXPECT_EQ(is_bright(u, 195), u == 364 || u == 415) << u;
  for (int v = 0; v < 390; ++v) EXPECT_EQ(is_bright(390, v), v == 182 || v == 207) << v;
}

TEST_F(PreviewCommand, WhatIsNotANumberHasAColourOfItsOwn) {
  std::vector<float> samples(30 * 30 * 30, 1);
  for (std::size_t i = 0; i < samples.size(); i += 3) samples[i] = static_cast<float>(i % 100);
  samples[15 * 900 + 10 * 30 + 20] = std::numeric_limits<float>::quiet_NaN();
  samples[15 * 900 + 10 * 30 + 24] = std::numeric_limits<float>::infinity();
  make_nrrd("nan.nrrd", "type: float\nsizes: 30 30 30\n",
            {reinterpret_cast<const char*>(samples.data()), 4 * samples.size()});
  works("encode nan.nrrd");
  const PngPicture picture = preview("nan.tag");
  const SheetPlaces places = places_on_sheet(panels({30, 30, 30}, {15, 15, 15}));
  const auto colour_at = [&](int x) {
    return picture.at(places.slices[2].x + 26 * x + 13, places.slices[2].y + 26 * 10 + 13);
  };
  EXPECT_EQ(colour_at(20), (std::array<int, 3>{colour_of_nan.red, colour_of_nan.green, colour_of_nan.blue}));
  EXPECT_EQ(colour_at(24), (std::array{255, 255, 255}));
}

TEST_F(PreviewCommand, WindowsAreInTheUnitsOfTheSource) {
  std::string samples;
  for (int i = 0; i < 20 * 20 * 20; ++i) samples += {static_cast<char>(i % 200), 0};
  make_nrrd("ct.nrrd",
            "type: int16\nsizes: 20 20 20\nrescale_slope:=2\nrescale_intercept:=-1000\nrescale_units:=HU\n",
            samples);
  make_nrrd("raw.nrrd", "type: int16\nsizes: 20 20 20\n", samples);
  works("encode ct.nrrd -q");
  works("encode raw.nrrd -q");
  const Volume volume = decoded("ct.tag", {20, 20, 20});
  expect_grey(preview("ct.tag", {"--window", "-1000:-700"}), volume, {10, 10, 10}, {0, 150});
  expect_grey(preview("raw.tag", {"--window", "0:150"}), volume, {10, 10, 10}, {0, 150});
}

TEST_F(PreviewCommand, EveryKindOfFileHasAPreview) {
  phantom("volume.nrrd");
  for (const std::string options : {"--grid-only", "--grid-only --max-error 9", "--cube 256"}) {
    works("encode volume.nrrd -f " + options);
    EXPECT_EQ(preview("volume.tag").width, 1600);
  }
  for (const std::string dims : {"64,64,1", "1,90,70", "1,1,1", "900,3,2", "3,2,900"}) {
    works("phantom -o thin.nrrd -qf --dims " + dims);
    works("encode thin.nrrd -f");
    const PngPicture picture = preview("thin.tag");
    EXPECT_EQ(picture.width, 1600);
    EXPECT_LT(picture.height, 2000);
  }
}

TEST_F(PreviewCommand, WhatMakesNoSenseIsRefused) {
  make_tag();
  for (const char* slice : {"z", "z=", "w=3", "z=1.5", "=3", "zz=3", "20"})
    fails(std::string("preview volume.tag --slice ") + slice, usage, "--slice");
  for (const char* window : {"1", "1:", "5:5", "6:5", "a:b", "0:nan"})
    fails(std::string("preview volume.tag --window ") + window, usage, "--window");
  fails("preview volume.tag --slice z=36", usage, "0 to 35");
  fails("preview volume.tag --slice z=-1", usage, "0 to 35");
  fails("preview volume.tag -M 1M", usage, "-M");
  fails("preview volume.tag -o a.jpg", usage, ".png");
  expect_error(tagrid({"preview", "-", "-o", "a.png"}, content("volume.tag")), usage, "save it to");
  fails("preview volume.nrrd -o a.png", broken_input, "volume.nrrd");
  fails("preview missing.tag", world, "missing.tag");
  fails("preview . -o a.png", usage, "is a directory, not a .tag file");
  EXPECT_EQ(names(), (std::vector<std::string>{"volume.nrrd", "volume.tag"}));
  file("a.png", "mine");
  fails("preview volume.tag -o a.png", usage, "-f");
  EXPECT_EQ(content("a.png"), "mine");
  Process terminal({program_under_test(), "preview", "volume.tag", "-o", "-"}, folder_.string(),
                   Process::Output::terminal);
  EXPECT_EQ(terminal.finish().code, usage);
}

TEST_F(PreviewCommand, TheSmallestMemoryThatAnErrorNamesIsKept) {
  works("phantom --dims 300,200,100 -o volume.nrrd -q");
  works("encode volume.nrrd");
  const std::string message = tagrid({"preview", "volume.tag", "-M", "1M"}).err;
  const std::size_t at = message.find("-M ");
  ASSERT_NE(at, message.npos) << message;
  const std::string least = message.substr(at + 3, message.find('M', at + 3) - at - 2);
  const Ending ending = tagrid({"preview", "volume.tag", "-M", least, "-T", "8"});
  expect_ok(ending);
  if (program_is_sanitized()) GTEST_SKIP() << "sanitizers take memory";
  EXPECT_LE(ending.peak_bytes, std::stoull(least) << 20) << least;
}

}  // namespace
}  // namespace tagrid
