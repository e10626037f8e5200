// --grid derived: what a user does with a file that stores no grid.
#include "io/errors/errors.h"
#include "tests/support/command_line.h"
#include "tests/support/tag_in_memory.h"

namespace tagrid {
namespace {

class DerivedGridCommand : public CommandLine {
 protected:
  // decoded.nrrd, and same.tag: what stores the grid that volume.tag does not.
  void make_both(const Arguments& more) const {
    expect_ok(tagrid({"phantom", "--dims", "52,40,36", "-q", "-f", "-o", "volume.nrrd"}));
    expect_ok(tagrid(with({"encode", "volume.nrrd", "-f", "--grid", "derived"}, more)));
    expect_ok(tagrid({"decode", "volume.tag", "-f", "-o", "decoded.nrrd"}));
    expect_ok(tagrid({"encode", "decoded.nrrd", "-f", "-o", "same.tag"}));
  }
  std::string out(const Arguments& arguments, std::string_view input = {}) const {
    const Ending ending = tagrid(arguments, input);
    EXPECT_EQ(ending.code, 0) << ending.err;
    return ending.out;
  }
};

TEST_F(DerivedGridCommand, MeshesAndLevelsAreThoseOfTheDecodedVoxels) {
  make_both({"--max-error", "40", "--effort", "best"});
  for (const char* name : {"volume", "same"})
    expect_ok(tagrid({"mesh", name + std::string(".tag"), "-M", "60M"}));
  EXPECT_TRUE(content("volume.vtu") == content("same.vtu"));
  const auto derived = nlohmann::json::parse(out({"info", "volume.tag", "--json"})),
             stored = nlohmann::json::parse(out({"info", "same.tag", "--json"}));
  EXPECT_EQ(derived["levels"], stored["levels"]);
  EXPECT_EQ(derived["grid"], "derived");
  EXPECT_EQ(stored["grid"], "stored");
  EXPECT_EQ(derived["bytes"]["activity"], 0);
}

TEST_F(DerivedGridCommand, InfoSaysSoAndCanLeaveOutTheLevels) {
  make_both({"--max-error", "7"});
  const std::string file = content("volume.tag"), with_levels = out({"info", "volume.tag"});
  EXPECT_TRUE(has(with_levels, "\ngrid            derived"));
  EXPECT_TRUE(has(with_levels, "active points"));
  EXPECT_EQ(out({"info", "-"}, file), with_levels);
  const std::string without = out({"info", "volume.tag", "--no-levels"});
  EXPECT_FALSE(has(without, "active points"));
  EXPECT_EQ(with_levels.find(without), 0U) << "the rest is the same";
  EXPECT_EQ(out({"info", "-", "--no-levels"}, file), without);
  EXPECT_TRUE(
      nlohmann::json::parse(out({"info", "volume.tag", "--no-levels", "--json"}))["levels"].is_null());
}

TEST_F(DerivedGridCommand, VerifyChecksTheGridFromAFileAndFromAPipe) {
  make_both({"--max-error", "7"});
  const std::string derived = out({"verify", "volume.tag", "--against", "volume.nrrd"}),
                    stored = out({"verify", "same.tag"});
  const auto points = [](const std::string& text) {
    return text.substr(text.find("the grid of")).substr(0, 40);
  };
  EXPECT_EQ(points(derived), points(stored));
  EXPECT_TRUE(has(derived, "largest error against volume.nrrd: 7"));
  EXPECT_EQ(points(out({"verify", "-"}, content("volume.tag"))), points(stored));
  std::string damaged = content("volume.tag");
  damaged[damaged.size() / 2] = static_cast<char>(damaged[damaged.size() / 2] ^ 1);
  EXPECT_EQ(tagrid({"verify", "-"}, damaged).code, broken_input);
  EXPECT_EQ(tagrid({"info", "-"}, damaged).code, broken_input);
}

TEST_F(DerivedGridCommand, WhatNeedsAStoredGridIsRefusedInWords) {
  phantom("volume.nrrd");
  for (const Arguments& other :
       {Arguments{"--grid-only"}, {"--max-error", "5", "--surface-error", "1"}, {"--mesh-error", "9"}}) {
    const Ending refused = tagrid(with({"encode", "volume.nrrd", "--grid", "derived"}, other));
    expect_error(refused, usage, "cannot be combined with --grid derived");
    EXPECT_FALSE(std::filesystem::exists(path("volume.tag")));
    expect_ok(tagrid(with({"encode", "volume.nrrd", "-f"}, other)));
    std::filesystem::remove(path("volume.tag"));
  }
  expect_error(tagrid({"encode", "volume.nrrd", "--grid", "none"}), usage, "stored");
}

}  // namespace
}  // namespace tagrid
