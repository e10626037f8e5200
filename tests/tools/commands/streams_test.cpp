// Streams, and large volumes through them.
#include "tests/support/command_line.h"
#include "tests/support/tag_in_memory.h"

namespace tagrid {
namespace {

// Pipes, and the same bytes on every path.

class Streams : public CommandLine {};

TEST_F(Streams, EncodeOfAPipeWritesToThePipe) {
  phantom("volume.nrrd");
  phantom("volume.raw");
  const std::string raw = " --dims 52,40,36 --type int16";
  for (const std::string options : {"", " --grid derived --max-error 3 --cube 8 --brick 1"}) {
    const std::string encode = "encode -f" + options;
    works(encode + " volume.nrrd");
    const std::string piped = out(encode + " -", content("volume.nrrd"));
    EXPECT_EQ(header_and_bricks(piped), header_and_bricks(content("volume.tag")));
    EXPECT_EQ(out(encode + " -" + raw, content("volume.nrrd")), piped)
        << "what starts as NRRD is read as that";
    works(encode + " volume.raw -o raw.tag" + raw);
    EXPECT_EQ(header_and_bricks(out(encode + " -" + raw, content("volume.raw"))),
              header_and_bricks(content("raw.tag")));
    EXPECT_EQ(out(encode + " volume.nrrd -o -"), content("volume.tag"));
  }
}

TEST_F(Streams, DecodeOfAPipeWritesSamplesAlone) {
  make_tag();
  const std::string tag = content("volume.tag"), nrrd = content("volume.nrrd");
  EXPECT_EQ(out("decode -", tag), samples_of(nrrd));
  EXPECT_EQ(out("decode volume.tag -o -"), samples_of(nrrd));
  EXPECT_EQ(out("decode - --format nrrd", tag), nrrd);
  expect_error(tagrid({"decode", "-", "--format", "nhdr"}, tag), usage, "nhdr");
}

TEST_F(Streams, NamedPipesAndDevicesAreWrittenStraight) {
  make_tag();
  phantom("volume.raw");
  expect_ok(
      script("mkfifo pipe; cat pipe > copy & \"$TAGRID\" decode volume.tag -o pipe; wait; "
             "cmp copy volume.raw"));
  works("encode volume.nrrd -o /dev/null");
}

// A name of a pipe is a pipe: mkfifo, or <(...) of a shell.
TEST_F(Streams, ANamedPipeIsReadAsTheStandardInputIs) {
  make_tag();
  phantom("volume.raw");
  const auto fed = [&](const std::string& file, const std::string& words) {
    return script("rm -f pipe; mkfifo pipe; cat " + file + " > pipe & timeout 60 $TAGRID " + words +
                  "; code=$?; kill $! 2> /dev/null; exit $code");
  };
  for (const std::string& more :
       {std::string(), std::string(" -T3 --max-error 3"), std::string(" --max-error noise:1 --spool .")}) {
    expect_ok(fed("volume.raw", "encode pipe --dims 52,40,36 --type int16 -fqo piped.tag" + more));
    expect_ok(script("cat volume.raw | $TAGRID encode - --dims 52,40,36 --type int16 -fqo in.tag" + more));
    EXPECT_TRUE(content("piped.tag") == content("in.tag")) << more;
  }
  expect_ok(fed("volume.nrrd", "encode pipe -fo piped.tag"));
  EXPECT_EQ(header_and_bricks(content("piped.tag")), header_and_bricks(content("volume.tag")));
  expect_ok(fed("volume.tag", "decode pipe -fo piped.raw"));
  EXPECT_TRUE(content("piped.raw") == content("volume.raw"));
  EXPECT_EQ(fed("volume.tag", "info pipe --json").out, tagrid({"info", "volume.tag", "--json"}).out);
  for (const char* words :
       {"verify pipe -q", "mesh pipe -fqo piped.vtu", "surface pipe --iso 300 -fqo piped.stl",
        "decode pipe --region 3:9,:,: -fqo piped.raw"})
    expect_ok(fed("volume.tag", words));
  expect_ok(fed("volume.nrrd", "verify volume.tag --against pipe -q"));
  expect_ok(
      script("$TAGRID encode <(cat volume.nrrd) -fo piped.tag && $TAGRID verify -q <(cat piped.tag) "
             "--against volume.nrrd"));
}

TEST_F(Streams, WhatNeedsAFileTwiceRefusesANamedPipe) {
  make_tag();
  const auto before = [&] { return script("rm -f pipe; mkfifo pipe"); };
  expect_ok(before());
  // Each is refused at once, without somebody who writes to the pipe.
  for (const Arguments& command :
       {words("encode pipe --resume -o x.tag"), words("encode pipe --rm -o x.tag"), words("restore pipe"),
        words("decode pipe --salvage -o x.raw"), words("decode pipe --rm -o x.raw")})
    expect_error(tagrid(command), usage, "");
  EXPECT_FALSE(std::filesystem::exists(path("x.tag")) || std::filesystem::exists(path("x.raw")));
  fails("encode /dev/null -o x.tag", broken_input, "is empty");
  fails("encode /dev/zero --dims 9,9,9 --type int16 -o x.tag", broken_input, "more are present");
  ASSERT_EQ(
      script("/usr/bin/python3 -c \"import socket; socket.socket(socket.AF_UNIX).bind('socket')\"").code, 0);
  fails("encode socket -o x.tag", world, "it is a socket");
  fails("decode socket -o x.raw", world, "it is a socket");
}

TEST_F(Streams, InfoOfAPipeIsThatOfTheFile) {
  make_tag();
  const std::string bytes = content("volume.tag");
  EXPECT_EQ(out("info - --json", bytes), out("info volume.tag --json"));
  EXPECT_EQ(out("info -", bytes), out("info volume.tag"));
  out("verify - --against volume.nrrd", bytes);
}

TEST_F(Streams, AClosedPipeEndsQuietlyAndLeavesNoTemporaries) {
  make_tag();
  const Ending by_signal =
      script("\"$TAGRID\" phantom --dims 99,99,99 | head -c 9 > x; echo ${PIPESTATUS[0]}");
  EXPECT_EQ(by_signal.out, std::to_string(128 + SIGPIPE) + "\n");
  EXPECT_EQ(by_signal.err, "");
  const Ending ignored =
      script("(trap '' PIPE; \"$TAGRID\" phantom --dims 99,99,99; echo $? > code) | head -c 9 > x; cat code");
  EXPECT_EQ(ignored.out, "74\n");
  EXPECT_EQ(ignored.err, "");
  script("rm *; \"$TAGRID\" phantom --dims 99,99,99 --json x.json | head -c 9 > x");
  EXPECT_EQ(names(), std::vector<std::string>{"x"});
}

TEST_F(Streams, AStandardOutputThatWasClosedIsNoFileOfOurs) {
  make_tag();
  expect_error(script("\"$TAGRID\" decode volume.tag -o - >&-"), world, "standard output");
  expect_error(script("\"$TAGRID\" info volume.tag >&-"), world, "standard output");
  expect_error(script("\"$TAGRID\" encode - -o x.tag <&-"), world, "standard input");
  // Progress messages must not end up in the written file.
  expect_ok(script("\"$TAGRID\" encode volume.nrrd -o x.tag --progress=bar <&- 2>&-; cmp x.tag volume.tag"));
}

TEST_F(Streams, TextThatCannotBeWrittenIsAnError) {
  make_tag();
  expect_error(script("\"$TAGRID\" info volume.tag > /dev/full"), world, "No space left");
  expect_error(script("\"$TAGRID\" --help > /dev/full"), world, "No space left");
}

// Volumes with more voxels and bytes than 32 bits can count.

class LargeVolume : public CommandLine {
 protected:
  static constexpr std::uint64_t voxels = 1300ull * 1300 * 1271;
  static_assert(voxels > std::uint64_t{1} << 31 && 2 * voxels > std::uint64_t{1} << 32);

  void SetUp() override {
    if (program_is_sanitized()) GTEST_SKIP() << "under a sanitizer this would take a quarter of an hour";
  }

  /// Air, with some different voxels around numbers of 31, 32 and 33 bits. Takes no disk space.
  void make_volume(const std::string& name) const {
    std::ofstream(path(name), std::ios::binary).put(0);
    std::filesystem::resize_file(path(name), 2 * voxels);
    std::fstream file(path(name), std::ios::binary | std::ios::in | std::ios::out);
    const std::uint64_t bits_31 = std::uint64_t{1} << 31;
    for (const std::uint64_t voxel : {std::uint64_t{0}, bits_31 / 2 - 1, bits_31 / 2, bits_31 - 1, bits_31,
                                      bits_31 + 1, voxels - 1300, voxels - 1}) {
      const std::array<char, 2> sample = {static_cast<char>(1 + voxel % 100), 3};
      file.seekp(static_cast<std::streamoff>(2 * voxel));
      file.write(sample.data(), sample.size());
    }
    ASSERT_TRUE(file.flush().good());
  }
};

TEST_F(LargeVolume, ComesBack) {
  make_volume("a.raw");
  works("encode a.raw --dims 1300,1300,1271 --type int16 -M 200M -T 2 -o a.tag");
  expect_ok(script("$TAGRID decode a.tag -M 300M -T 2 -o - | cmp - a.raw"));
  // Every point of the grid is checked, too.
  works("verify a.tag -q -M 200M -T 2");
}

}  // namespace
}  // namespace tagrid
