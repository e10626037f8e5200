// Broken files, and what is saved of them.
#include <fmt/format.h>

#include "io/errors/errors.h"
#include "tests/support/command_line.h"
#include "tests/support/tag_in_memory.h"

namespace tagrid {
namespace {

// Broken input: exit code 65, one line, and nothing left behind.

class BrokenFiles : public CommandLine {
 protected:
  /// Expects that only the earlier files exist.
  void expect_only(std::vector<std::string> expected) const { EXPECT_EQ(names(), expected); }
};

TEST_F(BrokenFiles, AMissingInputIsAFailureOfTheWorld) {
  for (const char* command : {"encode", "decode", "info", "verify"})
    expect_error(tagrid({command, "missing"}), world, "missing: cannot open");
  expect_only({});
}

// As git-annex leaves them for content that it does not keep.
TEST_F(BrokenFiles, ALinkThatLeadsNowhereIsNoInput) {
  expect_ok(script("mkdir folder && ln -s nowhere folder/a.dcm && ln -s nowhere link"));
  const std::string says =
      ": is a broken symbolic link; its content may have to be fetched first (git annex get)";
  for (const char* command : {"encode", "decode", "info", "verify"})
    expect_error(tagrid({command, "link"}), broken_input, "link" + says);
  fails("encode folder", broken_input, "folder/a.dcm" + says);
  expect_ok(script("echo text > folder/README"));
  fails("encode folder", broken_input, "folder/a.dcm" + says);
}

TEST_F(BrokenFiles, AFolderIsNoInput) {
  expect_ok(script("mkdir folder"));
  for (const char* command : {"decode", "info", "verify"})
    expect_error(tagrid({command, "folder"}), usage,
                 "folder: is a directory, not a .tag file; encode it first");
  fails("encode folder", broken_input, "folder: is an empty directory");
  expect_error(tagrid(with({"encode", "folder"}, raw_)), broken_input, "folder: has no files");
  expect_ok(script("mkdir folder/deeper"));
  fails("encode folder", broken_input,
        "folder: has no files, only directories; tagrid convert --find folder lists the volumes in it");
  expect_ok(script("echo text > folder/notes"));
  fails("encode folder", broken_input,
        "folder: is a directory, but its first files are not slices of DICOM or TIFF or EDF of the "
        "ESRF or JPEG 2000");
  expect_only({"folder"});
}

TEST_F(BrokenFiles, AnEmptyFile) {
  file("empty", "");
  for (const char* command : {"encode", "decode", "info", "verify", "mesh"})
    for (const char* input : {"empty", "-"}) {
      const Ending ending = tagrid({command, input});
      expect_error(ending, broken_input, *input == '-' ? "standard input: " : "empty: ");
      EXPECT_TRUE(has(ending.err, "is empty"));
    }
  expect_error(tagrid(with({"encode", "empty"}, raw_)), broken_input, "empty: is empty; 149760 bytes");
  expect_error(tagrid(with({"encode", "-"}, raw_)), broken_input, "ends after 0");
  expect_only({"empty"});
}

TEST_F(BrokenFiles, NotAVolumeAndNotATag) {
  file("text", std::string(5000, 'x'));
  fails("encode text", broken_input, "--dims");
  for (const char* command : {"decode", "info", "verify"})
    expect_error(tagrid({command, "text"}), broken_input,
                 "not a .tag file, or its beginning is damaged; if it is a volume, encode it first");
  file("header.nrrd", "NRRD0004\ntype: short\ndimension: 2\nsizes: 4 4\nencoding: raw\nendian: little\n\n");
  fails("encode header.nrrd", broken_input, "header.nrrd: ");
  expect_only({"header.nrrd", "text"});
}

TEST_F(BrokenFiles, DimsThatDoNotFitSayBothSizes) {
  phantom("volume.raw");
  const Ending ending = tagrid({"encode", "volume.raw", "--dims", "52,40,35", "--type", "int16"});
  expect_error(ending, broken_input, std::to_string(52 * 40 * 35 * 2));
  expect_error(ending, broken_input, std::to_string(52 * 40 * 36 * 2));
  phantom("volume.nrrd");
  const Ending nrrd = tagrid({"encode", "volume.nrrd", "--dims", "40,52,36", "--type", "int16"});
  expect_error(nrrd, broken_input, "52 x 40 x 36 int16");
  expect_error(nrrd, broken_input, "40 x 52 x 36 int16");
  expect_only({"volume.nrrd", "volume.raw"});
}

TEST_F(BrokenFiles, VolumesThatEndTooSoonOrTooLate) {
  phantom("volume.nrrd");
  const std::string nrrd = content("volume.nrrd"), raw = samples_of(nrrd),
                    no_header = "--dims 52,40,36 --type int16";
  file("short.nrrd", nrrd.substr(0, nrrd.size() - 1));
  file("long.nrrd", nrrd + "x");
  fails("encode short.nrrd", broken_input, "are present");
  // A header says where the samples end, and what follows is known before they are read.
  EXPECT_EQ(tagrid({"encode", "long.nrrd"}).code, 0);
  for (const auto& [options, whole] : {std::pair(std::string(), nrrd), {no_header, raw}})
    for (const char* output : {"-", "x.tag"}) {
      const Arguments encode = with({"encode", "-", "-o", output}, words(options));
      expect_error(tagrid(encode, whole.substr(0, whole.size() - 1)), broken_input, "ends after");
      expect_error(tagrid(encode, whole + "x"), broken_input, "more are present");
    }
  expect_only({"long.nrrd", "long.tag", "short.nrrd", "volume.nrrd"});
}

TEST_F(BrokenFiles, ATruncationOfATagIsFoundAndAByteMore) {
  make_tag({"--cube", "8", "--max-error", "9"});
  const std::string bytes = content("volume.tag");
  for (const std::size_t size : {std::size_t{1}, std::size_t{40}, bytes.size() / 3, bytes.size() - 1}) {
    file("short.tag", bytes.substr(0, size));
    for (const std::string command : {"decode", "info", "verify"}) {
      fails(command + " short.tag", broken_input, "short.tag: ");
      expect_error(tagrid({command, "-"}, bytes.substr(0, size)), broken_input, "standard input: ");
      EXPECT_EQ(tagrid({command, "-"}, bytes + "x").code, broken_input);
    }
  }
  expect_only({"short.tag", "volume.nrrd", "volume.tag"});
}

TEST_F(BrokenFiles, APipeGetsVerifiedBricksOnly) {
  make_tag({"--cube", "8", "--brick", "1"});
  std::string bytes = content("volume.tag");
  phantom("volume.raw");
  const std::size_t middle = bytes.size() / 2;
  bytes[middle] = static_cast<char>(bytes[middle] ^ 1);
  const Ending ending = tagrid({"decode", "-"}, bytes);
  expect_error(ending, broken_input, "brick");
  EXPECT_GT(ending.out.size(), 0U);
  EXPECT_EQ(ending.out, content("volume.raw").substr(0, ending.out.size()));
}

TEST_F(BrokenFiles, APipeForWhichThereIsTooLittleMemoryIsRefusedAtOnce) {
  // The size of a pipe is unknown: a claimed size takes only as much memory as bytes arrive.
  const Arguments huge = {"encode", "-", "--dims", "100000000,1000000000,1", "--type", "int8"};
  expect_error(tagrid(huge, "x"), usage, "--spool DIR");
}

// Damaged files on the command line: what is whole is given, and what is not is listed.

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
  EXPECT_TRUE(has(ending.err, "1 of "));
  EXPECT_TRUE(has(ending.err, "lost samples became -7, all others were decoded"));
  const nlohmann::json lost = json_of("rest.json")["lost"];
  ASSERT_EQ(lost.size(), 1u);
  const auto at = [&](const char* end, int axis) {
    return lost[0][end][static_cast<std::size_t>(axis)].get<int>();
  };
  // The message names the region, as --region takes it: what lies there is the fill, and all else is as it
  // was.
  const std::string region = fmt::format("{}:{},{}:{},{}:{}", at("low", 0), at("high", 0), at("low", 1),
                                         at("high", 1), at("low", 2), at("high", 2));
  EXPECT_TRUE(has(ending.err, region));
  works("encode rest.nrrd");
  works("decode volume.tag -o whole.nrrd");
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
  EXPECT_TRUE(has(ending.out, "is damaged or missing: region"));
  EXPECT_TRUE(has(ending.out, "decode --salvage"));
  EXPECT_EQ(json_of("a.json")["damaged"].size(), 1u);
  EXPECT_EQ(tagrid({"decode", "damaged.tag", "--salvage", "-o", "rest.nrrd"}).code, broken_input);
  EXPECT_FALSE(content("rest.nrrd").empty());
  // Nothing of this is said of a file that is whole but not of this original.
  phantom("other.nrrd", {"--seed", "9"});
  fails("verify volume.tag --against other.nrrd", broken_input, "");
  EXPECT_EQ(tagrid({"verify", "volume.tag", "--against", "other.nrrd"}).out, "");
}

TEST_F(SalvageCommand, AByteThatFollowsTheBricksCostsNone) {
  make_tag();
  std::string damaged = content("volume.tag");
  damaged[damaged.size() - 30] = static_cast<char>(damaged[damaged.size() - 30] ^ 0x11);
  file("damaged.tag", damaged);
  fails("decode damaged.tag --salvage -o rest.nrrd", broken_input, "all bricks are intact");
  EXPECT_TRUE(content("rest.nrrd") == content("volume.nrrd"));
  EXPECT_TRUE(has(tagrid({"verify", "damaged.tag"}).out, "all bricks are intact; decode --salvage"));
}

TEST_F(SalvageCommand, IsAdvisedOnlyWhereItHelps) {
  make_damaged();
  const std::string nothing = "so that nothing can be repaired", salvage = "--salvage";
  fails("repair damaged.tag -o whole.tag", broken_input,
        nothing + "; tagrid decode damaged.tag --salvage decodes the intact bricks");
  EXPECT_FALSE(has(tagrid({"repair", "volume.tag", "-o", "whole.tag"}).err, salvage));
  std::string headless = content("volume.tag");
  headless[30] = static_cast<char>(headless[30] ^ 1);
  file("headless.tag", headless);
  fails("repair headless.tag -o whole.tag", broken_input, nothing);
  EXPECT_FALSE(has(tagrid({"repair", "headless.tag", "-o", "whole.tag"}).err, salvage));
  fails("decode headless.tag -o a.nrrd", broken_input, "without which nothing can be decoded");
  fails("decode volume.tag --overview 8 -o a.nrrd", usage, "--step 8 gives a smaller volume");
  for (const char* none : {"3", "4096"})
    EXPECT_FALSE(has(tagrid({"decode", "volume.tag", "--overview", none, "-o", "a.nrrd"}).err, "--step"));
}

TEST_F(SalvageCommand, WhatMakesNoSenseIsRefused) {
  make_damaged();
  fails("decode damaged.tag --fill 1 -o a.nrrd", usage, "--salvage");
  fails("decode damaged.tag --salvage --fill 0.5 -o a.nrrd", usage, "not a value of type int16");
  fails("decode damaged.tag --salvage --rm -o a.nrrd", usage, "--rm");
  fails("decode volume.nrrd --salvage -o a.nrrd", broken_input, "");
  EXPECT_FALSE(std::filesystem::exists(path("a.nrrd")));
}

}  // namespace
}  // namespace tagrid
