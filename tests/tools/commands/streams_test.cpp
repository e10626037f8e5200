// Pipes, and the same bytes on every path.

#include "tests/support/command_line.h"
#include "tests/support/header_and_bricks.h"

namespace tagrid {
namespace {

class Streams : public CommandLine {};

TEST_F(Streams, SameBytesForAnyThreadCountFromFileAndPipe) {
  phantom("volume.nrrd");
  for (const Arguments& options : {Arguments{"--max-error", "4"}, Arguments{"--grid-only"}, Arguments{}}) {
    // Several bricks, so that threads can finish in a different order.
    const Arguments encode = with({"encode", "--cube", "8", "--brick", "2"}, options);
    expect_ok(tagrid(with(encode, {"-T1", "-fo", "one.tag", "volume.nrrd"})));
    const std::string bytes = content("one.tag");
    for (const char* threads : {"2", "3", "7"}) {
      expect_ok(tagrid(with(encode, {"-T", threads, "-fo", "more.tag", "volume.nrrd"})));
      EXPECT_EQ(content("more.tag"), bytes) << threads;
      const Ending piped = tagrid(with(encode, {"-T", threads, "-"}), content("volume.nrrd"));
      expect_ok(piped);
      EXPECT_EQ(header_and_bricks(piped.out), header_and_bricks(bytes)) << threads;
      expect_ok(tagrid({"decode", "one.tag", "-T", threads, "-fo", threads + std::string(".raw")}));
    }
    EXPECT_EQ(content("2.raw"), content("7.raw"));
    EXPECT_EQ(content("3.raw"), content("7.raw"));
  }
}

TEST_F(Streams, EncodeOfAPipeWritesToThePipe) {
  phantom("volume.nrrd");
  phantom("volume.raw");
  expect_ok(tagrid({"encode", "volume.nrrd"}));
  EXPECT_EQ(header_and_bricks(tagrid({"encode", "-"}, content("volume.nrrd")).out),
            header_and_bricks(content("volume.tag")));
  expect_ok(tagrid(with({"encode", "volume.raw", "-o", "raw.tag"}, raw_)));
  EXPECT_EQ(header_and_bricks(tagrid(with({"encode", "-"}, raw_), content("volume.raw")).out),
            header_and_bricks(content("raw.tag")));
  EXPECT_EQ(tagrid({"encode", "volume.nrrd", "-o", "-"}).out, content("volume.tag"));
}

TEST_F(Streams, APipeThatStartsAsNrrdIsReadAsNrrd) {
  phantom("volume.nrrd");
  const Ending with_dims = tagrid(with({"encode", "-"}, raw_), content("volume.nrrd"));
  expect_ok(with_dims);
  EXPECT_EQ(with_dims.out, tagrid({"encode", "-"}, content("volume.nrrd")).out);
}

TEST_F(Streams, DecodeOfAPipeWritesSamplesAlone) {
  make_tag();
  phantom("volume.raw");
  EXPECT_EQ(tagrid({"decode", "-"}, content("volume.tag")).out, content("volume.raw"));
  EXPECT_EQ(tagrid({"decode", "volume.tag", "-o", "-"}).out, content("volume.raw"));
  const Ending nrrd = tagrid({"decode", "-", "--format", "nrrd"}, content("volume.tag"));
  EXPECT_EQ(nrrd.out, content("volume.nrrd"));
  expect_error(tagrid({"decode", "-", "--format", "nhdr"}, content("volume.tag")), usage, "nhdr");
}

TEST_F(Streams, APipelineOfAllThree) {
  phantom("volume.raw");
  expect_ok(
      script("\"$TAGRID\" phantom --dims 52,40,36 --format nrrd | \"$TAGRID\" encode - | "
             "\"$TAGRID\" decode - | cmp - volume.raw"));
}

TEST_F(Streams, NamedPipesAndDevicesAreWrittenStraight) {
  make_tag();
  phantom("volume.raw");
  expect_ok(
      script("mkfifo pipe; cat pipe > copy & \"$TAGRID\" decode volume.tag -o pipe; wait; "
             "cmp copy volume.raw"));
  expect_ok(tagrid({"encode", "volume.nrrd", "-o", "/dev/null"}));
}

TEST_F(Streams, InfoOfAPipeIsThatOfTheFile) {
  make_tag();
  const std::string bytes = content("volume.tag");
  EXPECT_EQ(tagrid({"info", "-", "--json"}, bytes).out, tagrid({"info", "volume.tag", "--json"}).out);
  EXPECT_EQ(tagrid({"info", "-"}, bytes).out, tagrid({"info", "volume.tag"}).out);
  expect_ok(tagrid({"verify", "-", "--against", "volume.nrrd"}, bytes));
}

TEST_F(Streams, AClosedPipeEndsQuietly) {
  make_tag();
  const Ending by_signal =
      script("\"$TAGRID\" phantom --dims 99,99,99 | head -c 9 > x; echo ${PIPESTATUS[0]}");
  EXPECT_EQ(by_signal.out, std::to_string(128 + SIGPIPE) + "\n");
  EXPECT_EQ(by_signal.err, "");
  const Ending ignored =
      script("(trap '' PIPE; \"$TAGRID\" phantom --dims 99,99,99; echo $? > code) | head -c 9 > x; cat code");
  EXPECT_EQ(ignored.out, "74\n");
  EXPECT_EQ(ignored.err, "");
}

TEST_F(Streams, AClosedPipeLeavesNoTemporaries) {
  script("\"$TAGRID\" phantom --dims 99,99,99 --json x.json | head -c 9 > x");
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

}  // namespace
}  // namespace tagrid
