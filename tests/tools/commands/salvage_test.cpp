// Damaged files on the command line: what is whole is given, and what is not is listed.

#include <fmt/format.h>

#include "tests/support/command_line.h"
#include "tests/support/frames.h"

namespace tagrid {
namespace {

using Json = nlohmann::json;

class SalvageCommand : public CommandLine {
 protected:
  /// Damages the last brick of volume.tag, a file of several bricks.
  void make_damaged() {
    make_tag({"--cube", "8", "--brick", "1", "--strip"});
    std::string bytes = content("volume.tag");
    const auto bricks = frames(bytes);
    char& byte = bytes[bricks.back().first + 10];
    byte = static_cast<char>(byte ^ 1);
    file("damaged.tag", bytes);
  }
};

TEST_F(SalvageCommand, WhatIsWholeIsWrittenAndTheExitCodeTellsThatItIsNotAll) {
  make_damaged();
  const Ending ending = tagrid(
      {"decode", "damaged.tag", "--salvage", "--fill", "-7", "-o", "rest.nrrd", "--json", "rest.json"});
  EXPECT_EQ(ending.code, broken_input);
  EXPECT_NE(ending.err.find("1 of "), std::string::npos) << ending.err;
  EXPECT_NE(ending.err.find("lost samples became -7, all others were decoded"), std::string::npos)
      << ending.err;
  const Json lost = json_of("rest.json")["lost"];
  ASSERT_EQ(lost.size(), 1u);
  const auto at = [&](const char* end, int axis) {
    return lost[0][end][static_cast<std::size_t>(axis)].get<int>();
  };
  // The message names the region, as --region takes it: what lies there is the fill, and all else is as it
  // was.
  const std::string region = fmt::format("{}:{},{}:{},{}:{}", at("low", 0), at("high", 0), at("low", 1),
                                         at("high", 1), at("low", 2), at("high", 2));
  EXPECT_NE(ending.err.find(region), std::string::npos) << ending.err;
  expect_ok(tagrid({"encode", "rest.nrrd"}));
  expect_ok(tagrid({"decode", "volume.tag", "-o", "whole.nrrd"}));
  const std::string samples = tagrid({"decode", "rest.tag", "--region", region, "-o", "-"}).out;
  ASSERT_FALSE(samples.empty());
  for (std::size_t i = 0; i < samples.size(); i += 2) ASSERT_EQ(samples.substr(i, 2), "\xF9\xFF");
  const std::string rest = samples_of(content("rest.nrrd")), whole = samples_of(content("whole.nrrd"));
  std::size_t different = 0;
  for (std::size_t i = 0; i < whole.size(); i += 2) different += rest.substr(i, 2) != whole.substr(i, 2);
  EXPECT_GT(different, 0u);
  EXPECT_LE(different, samples.size() / 2);
}

TEST_F(SalvageCommand, VerifyListsEveryDamagedBrickAndItsAdviceWorks) {
  make_damaged();
  const Ending ending = tagrid({"verify", "damaged.tag", "--json", "a.json"});
  EXPECT_EQ(ending.code, broken_input);
  EXPECT_NE(ending.out.find("is damaged or missing: region"), std::string::npos) << ending.out;
  EXPECT_NE(ending.out.find("decode --salvage"), std::string::npos) << ending.out;
  EXPECT_EQ(json_of("a.json")["damaged"].size(), 1u);
  EXPECT_EQ(tagrid({"decode", "damaged.tag", "--salvage", "-o", "rest.nrrd"}).code, broken_input);
  EXPECT_FALSE(content("rest.nrrd").empty());
  // Nothing of this is said of a file that is whole but not of this original.
  phantom("other.nrrd", {"--seed", "9"});
  expect_error(tagrid({"verify", "volume.tag", "--against", "other.nrrd"}), broken_input, "");
  EXPECT_EQ(tagrid({"verify", "volume.tag", "--against", "other.nrrd"}).out, "");
}

// Of the envelope, the index and the footer.
TEST_F(SalvageCommand, NoByteThatFollowsTheBricksCostsABrick) {
  for (const Arguments& more : {Arguments{}, Arguments{"--strip"}, Arguments{"--brick", "8"}}) {
    phantom("volume.nrrd", {"--dims", "23,19,21", "-f"});
    expect_ok(tagrid(with({"encode", "volume.nrrd", "-f", "--cube", "8", "--brick", "1"}, more)));
    const std::string whole = content("volume.tag");
    expect_ok(tagrid({"decode", "volume.tag", "-fo", "good.raw"}));
    const auto bytes = nlohmann::json::parse(tagrid({"info", "volume.tag", "--json"}).out)["bytes"];
    std::uint64_t start = 0;
    std::memcpy(&start, whole.data() + whole.size() - 24, sizeof start);  // of the index
    start -= bytes["envelope"].get<std::uint64_t>();
    for (std::size_t at = start; at < whole.size(); at += 1 + (whole.size() - start) / 24) {
      SCOPED_TRACE(at);
      std::string damaged = whole;
      damaged[at] = static_cast<char>(damaged[at] ^ 0x11);
      file("damaged.tag", damaged);
      expect_error(tagrid({"decode", "damaged.tag", "--salvage", "-fo", "rest.raw"}), broken_input,
                   "all bricks are intact");
      EXPECT_TRUE(content("rest.raw") == content("good.raw"));
    }
  }
}

TEST_F(SalvageCommand, WhatMakesNoSenseIsRefused) {
  make_damaged();
  expect_error(tagrid({"decode", "damaged.tag", "--fill", "1", "-o", "a.nrrd"}), usage, "--salvage");
  expect_error(tagrid({"decode", "damaged.tag", "--salvage", "--fill", "0.5", "-o", "a.nrrd"}), usage,
               "not a value of type int16");
  expect_error(tagrid({"decode", "damaged.tag", "--salvage", "--rm", "-o", "a.nrrd"}), usage, "--rm");
  expect_error(tagrid({"decode", "volume.nrrd", "--salvage", "-o", "a.nrrd"}), broken_input, "");
  EXPECT_FALSE(std::filesystem::exists(path("a.nrrd")));
}

TEST_F(SalvageCommand, OfAFileThatIsWholeAllIsGiven) {
  make_tag();
  expect_ok(tagrid({"decode", "volume.tag", "--salvage", "-o", "a.nrrd"}));
  expect_ok(tagrid({"decode", "volume.tag", "-o", "b.nrrd"}));
  EXPECT_TRUE(content("a.nrrd") == content("b.nrrd"));
}

}  // namespace
}  // namespace tagrid
