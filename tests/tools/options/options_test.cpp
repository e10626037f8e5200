// Options on the command line, and the results of mistakes there.

#include "io/errors/errors.h"
#include "tests/support/command_line.h"
#include "tests/support/tag_in_memory.h"

namespace tagrid {
namespace {

class Options : public CommandLine {
 protected:
  static void expect_warned_not(const Ending& ending) {
    EXPECT_EQ(ending.code, 0) << ending.err;
    EXPECT_EQ(ending.err.find("warning"), std::string::npos) << ending.err;
  }
};

TEST_F(Options, HelpAndVersionEndWithSuccess) {
  for (const char* command : {"encode", "decode", "info", "verify", "mesh", "preview", "phantom"}) {
    const Ending help = tagrid({command, "--help"});
    expect_ok(help);
    EXPECT_TRUE(has(help.out, "Usage")) << command;
  }
  expect_ok(tagrid({"--help"}));
  EXPECT_EQ(tagrid({"--version"}).out.rfind("tagrid ", 0), 0U);
}

TEST_F(Options, UnknownOptionsSuggestTheNearest) {
  expect_error(tagrid({"encode", "--max-eror", "3", "x.nrrd"}), usage, "did you mean --max-error?");
  expect_error(tagrid({"estimate", "--max-error", "5", "x.nrrd"}), usage, "did you mean --errors?");
  expect_error(tagrid({"encode", "--grid_only", "x.nrrd"}), usage, "did you mean --grid-only?");
  expect_error(tagrid({"decode", "--fromat=raw", "x.tag"}), usage, "--fromat; did you mean --format?");
}

TEST_F(Options, UnknownOptionsFarFromAllPointToTheHelp) {
  expect_error(tagrid({"encode", "--zyxwvu", "x.nrrd"}), usage, "see tagrid encode --help");
  expect_error(tagrid({"-z"}), usage, "see tagrid --help");
}

TEST_F(Options, UnknownCommandsSuggestTheNearest) {
  expect_error(tagrid({"encdoe", "x.nrrd"}), usage, "unknown command encdoe; did you mean encode?");
  expect_error(tagrid({"veryfi", "x.tag"}), usage, "did you mean verify?");
}

TEST_F(Options, ACommandAndItsInputAreRequired) {
  expect_error(tagrid({}), usage, "give a command, such as: tagrid encode VOLUME; see tagrid --help");
  for (const char* command : {"encode", "decode", "info", "verify"})
    expect_error(tagrid({command}), usage, "INPUT is required");
  expect_error(tagrid({"encode", "a", "b"}), usage, "b: one argument too many: only one input is accepted");
  expect_error(tagrid({"encode", "a", "b"}), usage, "give their directory instead");
  expect_error(tagrid({"decode", "a", "b"}), usage, "for several inputs, use a shell loop");
  expect_error(tagrid({"convert", "a"}), usage, "convert takes a list: tagrid convert --find a > list.tsv");
  expect_error(tagrid({"convert", "--manifest", "a", "b"}), usage,
               "b: one argument too many; see tagrid convert --help");
}

TEST_F(Options, WithoutTheirValueTheySayWhichTheyNeed) {
  expect_error(tagrid({"encode", "a.nrrd", "--max-error"}), usage,
               "encode: --max-error: needs a value: --max-error <E|noise:K>; see tagrid encode --help");
  expect_error(tagrid({"decode", "a.tag", "-o"}), usage, "--output: needs a value: --output <FILE>");
  expect_error(tagrid({"info", "a.tag", "-T"}), usage, "--threads: needs a value: --threads <N>");
}

TEST_F(Options, NamesAfterTwoDashesMayBeginWithOne) {
  phantom("volume.nrrd");
  expect_ok(script("mv volume.nrrd ./-volume.nrrd"));
  expect_ok(tagrid({"encode", "-o", "a.tag", "--", "-volume.nrrd"}));
  expect_ok(tagrid({"encode", "--", "-volume.nrrd"}));
  expect_ok(script("cmp ./-volume.tag a.tag"));
  expect_ok(tagrid({"info", "--", "-volume.tag"}));
  // As elsewhere, there are no options after it.
  expect_error(tagrid({"encode", "--", "-volume.nrrd", "-o", "b.tag"}), usage, "give options before it");
}

TEST_F(Options, OptionsBeforeTheCommandAreToldToComeAfterIt) {
  phantom("volume.nrrd");
  for (const Arguments& early :
       {Arguments{"-T", "2"}, {"-T2"}, {"--threads=2"}, {"-q"}, {"--max-error", "3"}}) {
    const std::string name = early[0].substr(0, early[0][1] == '-' ? early[0].find('=') : 2);
    expect_error(tagrid(with(early, {"encode", "volume.nrrd"})), usage,
                 name + ": options come after the command: tagrid encode " + name);
    expect_ok(tagrid(with({"encode", "volume.nrrd", "-f"}, early)));
  }
  expect_error(tagrid({"-T", "2"}), usage, "-T: options come after a command");
}

TEST_F(Options, DescriptionsOfSamplesAreRefusedWhereAHeaderHasThem) {
  phantom("volume.nrrd");
  const std::string why = "a file of any other format describes its samples itself: leave out --";
  for (const std::string option : {"dims=52,40,36", "type=int16", "endian=little", "offset=0"})
    expect_error(tagrid({"encode", "volume.nrrd", "--" + option}), usage,
                 why + option.substr(0, option.find('=')));
  file("spaced.nrrd",
       "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nspacings: 1 1 2\nencoding: raw\n\n12345678");
  const Arguments raw = {"--dims", "2,2,2", "--type", "uint8", "--spacing", "1,1,3"};
  expect_error(tagrid(with({"encode", "spaced.nrrd"}, raw)), usage,
               "states the spacing 1 1 2, but --spacing is 1 1 3; leave it out, or use --override-spacing");
  file("bare.nrrd", "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n\n12345678");
  expect_ok(tagrid(with({"encode", "bare.nrrd"}, raw)));
  EXPECT_EQ(nlohmann::json::parse(tagrid({"info", "bare.tag", "--json"}).out)["geometry"]["spacing"],
            nlohmann::json({1, 1, 3}));
}

TEST_F(Options, AVolumeWhereATagFileIsWantedIsToldToBeEncodedFirst) {
  phantom("volume.nrrd");
  phantom("volume.vdb", {"--type", "float32"});
  for (const char* command : {"decode", "info", "verify", "mesh"}) {
    const Ending ending = tagrid({command, "-"}, content("volume.nrrd"));
    expect_error(ending, broken_input, "not a .tag file, but an NRRD volume; encode it first");
    expect_error(tagrid({command, "-"}, content("volume.vdb")), broken_input,
                 "but an OpenVDB file; encode it first");
  }
  expect_error(tagrid({"decode", "volume.nrrd"}), broken_input, "but an NRRD volume; encode it first");
  expect_ok(tagrid({"encode", "volume.nrrd"}));
  expect_ok(tagrid({"info", "volume.tag"}));
}

TEST_F(Options, ValueAfterASpaceOrAnEqualsSign) {
  phantom("volume.nrrd");
  expect_ok(tagrid({"encode", "volume.nrrd", "--max-error", "3", "-o", "space.tag"}));
  expect_ok(tagrid({"encode", "--max-error=3", "volume.nrrd", "--output=equals.tag"}));
  EXPECT_EQ(content("space.tag"), content("equals.tag"));
}

TEST_F(Options, ShortOptionsTakeTheirValueAtOnceAndInOneWord) {
  phantom("volume.nrrd");
  expect_ok(tagrid({"encode", "-T2", "volume.nrrd", "-oa.tag"}));
  expect_ok(tagrid({"encode", "-fo", "a.tag", "-qk", "volume.nrrd"}));
}

TEST_F(Options, TheLastOfRepeatedOptionsCounts) {
  phantom("volume.nrrd");
  expect_ok(tagrid({"encode", "volume.nrrd", "--max-error", "9", "--max-error", "2"}));
  EXPECT_EQ(nlohmann::json::parse(tagrid({"info", "volume.tag", "--json"}).out)["max_error"], 2);
}

TEST_F(Options, NamesThatBeginWithADashComeAfterTwo) {
  phantom("volume.nrrd");
  expect_ok(script("cp volume.nrrd ./-x.nrrd; \"$TAGRID\" encode -o x.tag -- -x.nrrd"));
  expect_error(tagrid({"encode", "-x.nrrd"}), usage,
               "unknown option -x.nrrd; for the file of this name, give ./-x.nrrd");
  expect_ok(tagrid({"encode", "./-x.nrrd"}));
}

TEST_F(Options, ValuesOutOfRangeAreRefused) {
  phantom("volume.nrrd");
  const std::tuple<const char*, const char*, const char*> wrong[] = {
      {"", "--max-error", "-1 nan much inf 1e999 0x10 2,5"},
      {"", "--cube", "0x20 32.0 99999999999999999999 33 2 512"},
      {"", "-T", "1025 2x -1"},
      {"", "--range", "0:inf 0:1:2 5 5:5 5:x"},
      {"", "--effort", "most 2"},
      {"--type uint8", "--dims", "4,4 4,,4,4 4,4,4, 4,4,2147483649 0,4,4"},
      {"--dims 4,4,4 --type uint8", "--endian", "middle"},
      {"--dims 4,4,4 --type uint8", "--offset", "20000000000G"},
      {"--dims 4,4,4 --type uint8", "--spacing", "1,0,1"},
      {"--dims 4,4,4", "--type", "uint9"}};
  const auto refused = [&](const std::string& options) {
    SCOPED_TRACE(options);
    expect_error(tagrid(words("encode volume.nrrd " + options)), usage, "");
  };
  for (const auto& [others, option, values] : wrong)
    for (const std::string& value : words(values)) refused(others + std::string(" ") + option + " " + value);
  for (const char* alone : {"--accuracy 2", "--max-level 16", "--brick 0", "--field-scale 0",
                            "--progress much", "--offset -1", "--dims 4,4"})
    refused(alone);
  expect_error(tagrid({"encode", "volume.nrrd", "--max-error", " 2"}), usage, "");
  EXPECT_EQ(names(), std::vector<std::string>{"volume.nrrd"});
}

TEST_F(Options, BoundsThatAreRoundedDownToIntegersAreTold) {
  const auto warning_of = [this](const Arguments& options) {
    phantom("volume.nrrd", {"-f"});
    const Ending encoded = tagrid(with({"encode", "volume.nrrd", "-f"}, options));
    EXPECT_EQ(encoded.code, 0);
    return encoded.err;
  };
  const std::string begin = "tagrid: warning: volume.nrrd: ", rounded = ": samples are integers, so this is ";
  EXPECT_EQ(warning_of({"--max-error", "0.5"}), begin + "--max-error 0.5" + rounded + "0 (lossless)\n");
  EXPECT_EQ(warning_of({"--max-error", "2.5"}), begin + "--max-error 2.5" + rounded + "2\n");
  EXPECT_EQ(warning_of({"--mesh-error", "0.5"}), begin + "--mesh-error 0.5" + rounded + "0\n");
  EXPECT_EQ(warning_of({"--max-error", "3", "--surface-error", "1.5"}),
            begin + "--surface-error 1.5" + rounded + "1\n");
  EXPECT_EQ(warning_of({"--grid-only", "--max-error", "9.5"}), begin + "--max-error 9.5" + rounded + "9\n");
  EXPECT_EQ(warning_of({"--max-error", "2"}), "");
  EXPECT_EQ(warning_of({"--max-error", "2.5", "-q"}), "");
  // Half a Hounsfield unit is five steps of 0.1.
  file("steps.nrrd",
       "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\nrescale_slope:=0.1\n\nabcdefgh");
  expect_warned_not(tagrid({"encode", "steps.nrrd", "--max-error", "0.5"}));
  file("floats.raw", std::string(32, '\0'));
  expect_ok(tagrid({"encode", "floats.raw", "--dims", "2,2,2", "--type", "float32", "--max-error", "0.5"}));
}

TEST_F(Options, ADecimalCommaIsToldToBeAPoint) {
  const std::string hint = "; use a decimal point, not a comma";
  expect_error(tagrid({"encode", "a.nrrd", "--max-error", "1,5"}), usage, "such as 0.5" + hint);
  expect_error(tagrid({"encode", "a.nrrd", "-M", "1,5G"}), usage, "-M: 1,5G: must be a number of bytes");
  expect_error(tagrid({"encode", "a.nrrd", "-M", "1,5G"}), usage, "such as 800M or 1.5G" + hint);
  expect_error(tagrid({"encode", "a.nrrd", "--range", "0,5:3"}), usage, "must be lo:hi or auto" + hint);
  expect_error(tagrid({"preview", "a.tag", "--window", "0:2,5"}), usage, "must be lo:hi with lo < hi" + hint);
  expect_error(tagrid({"encode", "a", "--dims", "1,1,1", "--type", "int8", "--spacing", "0,5,0,5,1"}), usage,
               "must be one number above 0, or three of them (X,Y,Z), optionally with a unit: 10um, or "
               "0.5,0.5,1.25mm\n");
  expect_error(tagrid({"encode", "a.nrrd", "--spacing", "0,5mm"}), usage, "0.5,0.5,1.25mm" + hint);
  // Others are not.
  const Ending other = tagrid({"encode", "a.nrrd", "-M", "1,5X"});
  expect_error(other, usage, "1.5G");
  EXPECT_FALSE(has(other.err, "comma"));
}

TEST_F(Options, NumbersAreDecimalWhateverTheyBeginWith) {
  expect_ok(tagrid({"phantom", "--dims", "052,040,036", "-o", "octal.nrrd", "-T", "02"}));
  phantom("volume.nrrd");
  EXPECT_EQ(content("octal.nrrd"), content("volume.nrrd"));
  expect_ok(tagrid({"encode", "volume.nrrd", "--cube", "016", "--accuracy=020", "-o", "zero.tag"}));
  expect_ok(tagrid({"encode", "volume.nrrd", "--cube", "16", "--max-error", "-0", "-o", "none.tag"}));
  EXPECT_EQ(content("zero.tag"), content("none.tag"));
}

TEST_F(Options, BytesBeforeTheSamplesCanBeCountedInKibibytes) {
  phantom("volume.raw");
  file("more.raw", std::string(2048, 'x') + content("volume.raw"));
  expect_ok(tagrid(with({"encode", "volume.raw"}, raw_)));
  expect_ok(tagrid(with({"encode", "more.raw", "--offset", "2K"}, raw_)));
  EXPECT_EQ(header_and_bricks(content("more.tag")), header_and_bricks(content("volume.tag")));
}

TEST_F(Options, CombinationsThatMakeNoSenseAreRefused) {
  phantom("volume.nrrd");
  for (const char* options :
       {"--surface-error 1", "--surface-error 2 --max-error 2", "--surface-error 1 --max-error 2 --grid-only",
        "--grid-only --max-level 6 --max-error 2", "--field-scale 0.1 --range 0:9", "--dims 4,4,4",
        "--type int16", "--spacing 1,1,2", "--spacing 1,1,1 --override-spacing 1,1,1", "--endian big",
        "--keep --rm"}) {
    SCOPED_TRACE(options);
    expect_error(tagrid(with({"encode", "volume.nrrd"}, words(options))), usage, "");
  }
  EXPECT_EQ(names(), std::vector<std::string>{"volume.nrrd"});
}

TEST_F(Options, MessagesOnValuesSayWhatTheyMayBe) {
  const std::vector<std::pair<Arguments, std::string>> wrong = {
      {{"phantom", "--dims", "4,4,4", "--seed", "-1"}, "--seed: -1: must be a whole number"},
      {{"phantom", "--dims", "4,4,4", "--seed", "99999999999999999999"}, "below 2^64"},
      {{"encode", "x", "--dims=1,1,1", "--type=int8", "--offset=-3"}, "--offset: -3: must be a whole number"},
      {{"encode", "x", "--progress=foo"}, "--progress: foo: must be one of auto, bar, plain, none;"},
      {{"encode", "x", "--progress", "1"}, "--progress: 1: must be one of"},
      {{"encode", "x", "--endian", "middle"}, "--endian: middle: must be one of little, big;"},
      {{"decode", "x", "--format", "png"},
       "--format: png: must be one of nrrd, nhdr, raw, vdb, nifti, nifti.gz, metaimage, mhd, npy, tiff, vti, "
       "vtkhdf, hdf5, zarr;"}};
  for (const auto& [arguments, message] : wrong) {
    const Ending ending = tagrid(arguments);
    expect_error(ending, usage, message);
    EXPECT_LT(ending.err.size(), 170U) << ending.err;
  }
}

TEST_F(Options, WhatContradictsAnNrrdHeaderIsRefused) {
  phantom("volume.nrrd", {"--type", "int16"});
  const std::vector<Arguments> wrong = {{"--type", "uint16"}, {"--endian", "big"}};
  for (const Arguments& options : wrong)
    for (const char* input : {"volume.nrrd", "-"})
      expect_error(
          tagrid(with({"encode", input, "-o", "x.tag", "--dims", "52,40,36", "--type", "int16"}, options),
                 content("volume.nrrd")),
          usage, "its NRRD header ");
  expect_ok(tagrid(with({"encode", "volume.nrrd", "--endian=little", "--spacing=1,1,1"}, raw_)));
}

TEST_F(Options, BinaryOutputIsNotWrittenToATerminal) {
  make_tag();
  const auto on_terminal = [&](Arguments arguments) {
    arguments.insert(arguments.begin(), program_under_test());
    return Process(arguments, folder_.string(), Process::Output::terminal).finish();
  };
  expect_error(on_terminal({"encode", "volume.nrrd", "-o", "-"}), usage, "terminal");
  expect_error(on_terminal({"encode", "volume.nrrd", "-fo", "-"}), usage, "terminal");
  expect_error(on_terminal({"decode", "volume.tag", "-o", "-"}), usage, "terminal");
  expect_error(on_terminal({"phantom", "--dims", "4,4,4"}), usage, "terminal");
  expect_ok(on_terminal({"info", "volume.tag"}));
}

TEST_F(Options, QuietSaysNothingAndVerboseMore) {
  phantom("volume.nrrd");
  const Ending verbose = tagrid({"encode", "volume.nrrd", "-v"});
  EXPECT_TRUE(has(verbose.err, "ratio"));
  const Ending quiet = tagrid({"encode", "volume.nrrd", "-fqv", "--progress=bar"});
  expect_ok(quiet);
  EXPECT_EQ(tagrid({"verify", "volume.tag", "-q"}).out, "");
}

TEST_F(Options, VerboseTwiceTellsWhereTheTimeWent) {
  phantom("volume.nrrd");
  // Every thread that works is seen, and nothing twice: threads take no more than the process has.
  const auto expect_nodes = [&](const Arguments& arguments, const std::vector<std::string>& nodes) {
    const Ending once = tagrid(with(arguments, {"-v"})), twice = tagrid(with(arguments, {"-v", "-v"}));
    EXPECT_FALSE(has(once.err, "CPU s"));
    std::istringstream lines(twice.err);
    std::string line;
    std::getline(lines, line);
    EXPECT_TRUE(has(line, "CPU s"));
    for (const std::string& node : nodes) {
      std::getline(lines, line);
      EXPECT_TRUE(line.starts_with(node + "  ")) << line;
      EXPECT_GT(std::stod(line.substr(node.size())), -1e-9) << line;
    }
    EXPECT_TRUE(has(twice.err, "times as fast with 16 threads"));
    EXPECT_TRUE(has(twice.err, once.err.substr(0, once.err.find(" ->")))) << "the rest is as with one -v";
  };
  expect_nodes({"encode", "volume.nrrd", "-f"}, {"read slices", "read samples", "plan", "curvature",
                                                 "subdivide", "encode", "write bricks", "all else"});
  expect_nodes({"decode", "volume.tag", "-f", "-o", "out.nrrd"},
               {"read bricks", "decode", "write rows", "write samples", "all else"});
}

TEST_F(Options, ProgressIsABarOrPlainOrNothing) {
  phantom("volume.nrrd");
  const Ending bar = tagrid({"encode", "volume.nrrd", "--progress=bar"});
  EXPECT_TRUE(has(bar.err, "MB/s"));
  EXPECT_TRUE(has(bar.err, "left"));
  EXPECT_EQ(bar.err.substr(bar.err.size() - 4), "\r\033[K") << "the bar is cleared at the end";
  // A line every 30 seconds: none in a short run. Automatic: none without a terminal.
  for (const char* style : {"plain", "none", "auto"})
    expect_ok(tagrid({"encode", "volume.nrrd", "-f", "--progress", style}));
}

TEST_F(Options, AnotherTypeOrOrderOfBytesIsSuspected) {
  phantom("volume.raw");
  const auto told = [&](const std::string& dims, const Arguments& more) {
    const Ending ending = tagrid(with({"encode", "volume.raw", "-f", "--dims", dims}, more));
    EXPECT_EQ(ending.code, 0);
    return ending.err;
  };
  EXPECT_TRUE(has(told("52,40,36", {"--type", "int16", "--endian", "big"}),
                  "looks far more like a volume with --type int16 --endian little than with --type int16 "
                  "--endian big; check the type and the byte order"));
  EXPECT_TRUE(has(told("104,40,36", {"--type", "uint8"}), "looks far more like samples of 2 bytes"));
  EXPECT_EQ(told("52,40,36", {"--type", "int16"}), "");
  EXPECT_EQ(told("52,40,36", {"--type", "int16", "--endian", "big", "-q"}), "");
}

TEST_F(Options, SamplesFarBeyondTheUsualRangeAreToldWhereAMeshIsAskedFor) {
  std::string samples;
  for (int i = 0; i < 20 * 20 * 20; ++i) {
    const int v = i % 20 * 3000;
    samples += {static_cast<char>(v & 255), static_cast<char>(v >> 8)};
  }
  file("wide.raw", samples);
  const Arguments raw = {"--dims", "20,20,20", "--type", "uint16"};
  expect_ok(tagrid(with({"encode", "-", "-o", "piped.tag", "--strip"}, raw), samples));
  expect_ok(tagrid(with({"encode", "wide.raw", "--strip"}, raw)));
  EXPECT_TRUE(content("piped.tag") == content("wide.tag"));
  const std::string warning = "samples span 0 to 57000, but the grid was made for 0 to 4096";
  expect_error(tagrid({"mesh", "wide.tag"}), 0, warning);
  expect_error(tagrid(with({"encode", "wide.raw", "-f", "--grid-only"}, raw)), 0, warning);
  for (const Arguments& more :
       {Arguments{"--range", "auto"}, {"--range", "0:60000"}, {"--field-scale", "0.001"}}) {
    expect_ok(tagrid(with(with({"encode", "wide.raw", "-f"}, raw), more)));
    expect_ok(tagrid({"mesh", "wide.tag", "-f"}));
  }
  file("list.tsv", "wide.raw\n");
  expect_ok(tagrid(with({"convert", "--manifest", "list.tsv", "--output-dir", "out"}, raw)));
}

TEST_F(Options, AnotherOrderOfDimsIsSuspected) {
  phantom("volume.raw");
  const Ending wrong = tagrid({"encode", "volume.raw", "--dims", "40,52,36", "--type", "int16"});
  EXPECT_EQ(wrong.code, 0);
  EXPECT_TRUE(has(wrong.err, "--dims 52,40,36"));
  expect_ok(tagrid({"encode", "volume.raw", "-fq", "--dims", "40,52,36", "--type", "int16"}));
  expect_ok(tagrid(with({"encode", "volume.raw", "-f"}, raw_)));
}

// Files that people have: the message says what they are and what to do with them.
TEST_F(Options, FilesOfOtherFormatsAreRecognized) {
  make_tag();
  expect_ok(script("gzip -c volume.nrrd > a.gz"));
  const std::pair<const char*, const char*> files[] = {
      {"volume.tag", "is already a .tag file"},
      {"a.gz", "is compressed (gzip): `zcat "},
  };
  for (const auto& [name, advice] : files) {
    expect_error(tagrid({"encode", name, "-o", "x.tag"}), broken_input, advice);
    expect_error(tagrid({"encode", "-"}, content(name)), broken_input, advice);
    expect_error(tagrid({"encode", name, "-o", "x.tag", "--dims", "9,9,99", "--type", "int16"}), broken_input,
                 advice);
  }
  expect_error(tagrid({"encode", "a.gz", "-o", "x.tag"}), broken_input,
               "-o a.tag`, with --dims and --type if the samples have no header");
  expect_ok(script("zcat a.gz | $TAGRID encode - > b.tag"));
  EXPECT_EQ(header_and_bricks(content("b.tag")), header_and_bricks(content("volume.tag")));
  // The advice is for the command that was given.
  expect_error(tagrid({"verify", "volume.tag", "--against", "a.gz"}), broken_input,
               "verify NAME.tag --against -");
  EXPECT_EQ(script("zcat a.gz | $TAGRID verify volume.tag --against -").code, 0);
}

}  // namespace
}  // namespace tagrid
