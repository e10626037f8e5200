// --grid derived: what a user does with a file that stores no grid.
#include "tests/support/command_line.h"

namespace tagrid {
namespace {

class DerivedGridCommand : public CommandLine {};

// same.tag stores the grid that volume.tag does not.
TEST_F(DerivedGridCommand, MeshesLevelsAndChecksAreThoseOfTheDecodedVoxels) {
  make_tag({"--grid", "derived", "--max-error", "7"});
  works("decode volume.tag -o decoded.nrrd");
  works("encode decoded.nrrd -o same.tag");
  for (const std::string name : {"volume", "same"}) works("mesh -M 60M " + name + ".tag");
  EXPECT_TRUE(content("volume.vtu") == content("same.vtu"));
  const nlohmann::json derived = info("volume.tag"), stored = info("same.tag");
  EXPECT_EQ(derived["levels"], stored["levels"]);
  EXPECT_EQ(derived["grid"], "derived");
  EXPECT_EQ(stored["grid"], "stored");
  EXPECT_EQ(derived["bytes"]["activity"], 0);

  const auto points = [](const std::string& text) {
    return text.substr(text.find("the grid of")).substr(0, 40);
  };
  const std::string verified = out("verify volume.tag --against volume.nrrd"),
                    expected = points(out("verify same.tag"));
  EXPECT_TRUE(has(verified, "largest error against volume.nrrd: 7"));
  EXPECT_EQ(points(verified), expected);
  EXPECT_EQ(points(out("verify -", content("volume.tag"))), expected);
}

TEST_F(DerivedGridCommand, InfoSaysSoAndCanLeaveOutTheLevels) {
  make_tag({"--grid", "derived", "--max-error", "7"});
  const std::string file = content("volume.tag"), with_levels = out("info volume.tag");
  EXPECT_TRUE(has(with_levels, "\ngrid            derived"));
  EXPECT_TRUE(has(with_levels, "active points"));
  EXPECT_EQ(out("info -", file), with_levels);
  const std::string without = out("info volume.tag --no-levels");
  EXPECT_FALSE(has(without, "active points"));
  EXPECT_EQ(with_levels.find(without), 0U) << "the rest is the same";
  EXPECT_EQ(out("info - --no-levels", file), without);
  EXPECT_TRUE(nlohmann::json::parse(out("info volume.tag --no-levels --json"))["levels"].is_null());
}

TEST_F(DerivedGridCommand, WhatNeedsAStoredGridIsRefusedInWords) {
  phantom("volume.nrrd");
  for (const char* other : {"--grid-only", "--max-error 5 --surface-error 1", "--mesh-error 9"})
    fails(std::string("encode volume.nrrd --grid derived ") + other, usage,
          "cannot be combined with --grid derived");
  fails("encode volume.nrrd --grid none", usage, "stored");
  EXPECT_EQ(names(), std::vector<std::string>{"volume.nrrd"});
}

}  // namespace
}  // namespace tagrid
