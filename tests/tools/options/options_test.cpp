// Options on the command line, and the results of mistakes there.

#include "io/errors/errors.h"
#include "tests/support/command_line.h"
#include "tests/support/tag_in_memory.h"

namespace tagrid {
namespace {

class Options : public CommandLine {};

TEST_F(Options, HelpAndVersionEndWithSuccess) {
  for (const char* command : {"encode", "decode", "info", "verify", "mesh", "preview", "phantom"}) {
    const Ending help = tagrid({command, "--help"});
    expect_ok(help);
    EXPECT_TRUE(has(help.out, "Usage")) << command;
  }
  works("--help");
  EXPECT_EQ(tagrid({"--version"}).out.rfind("tagrid ", 0), 0U);
}

TEST_F(Options, MistakesAreToldWithWhatWasPerhapsMeant) {
  const std::string hint = "; use a decimal point, not a comma";
  const std::pair<const char*, std::string> wrong[] = {
      // Unknown options and commands.
      {"encode --max-eror 3 x.nrrd", "did you mean --max-error?"},
      {"estimate --max-error 5 x.nrrd", "did you mean --errors?"},
      {"encode --grid_only x.nrrd", "did you mean --grid-only?"},
      {"decode --fromat=raw x.tag", "--fromat; did you mean --format?"},
      {"encode --zyxwvu x.nrrd", "see tagrid encode --help"},
      {"-z", "see tagrid --help"},
      {"-T 2", "-T: options come after a command"},
      {"encdoe x.nrrd", "unknown command encdoe; did you mean encode?"},
      {"veryfi x.tag", "did you mean verify?"},
      // Inputs.
      {"", "give a command, such as: tagrid encode VOLUME; see tagrid --help"},
      {"decode", "INPUT is required"},
      {"info", "INPUT is required"},
      {"encode a b", "b: one argument too many: only one input is accepted"},
      {"encode a b", "give their directory instead"},
      {"decode a b", "for several inputs, use a shell loop"},
      {"convert a", "convert takes a list: tagrid convert --find a > list.tsv"},
      {"convert --manifest a b", "b: one argument too many; see tagrid convert --help"},
      // Values that are missing.
      {"encode a.nrrd --max-error",
       "encode: --max-error: needs a value: --max-error <E|noise:K>; see tagrid encode --help"},
      {"decode a.tag -o", "--output: needs a value: --output <FILE>"},
      {"info a.tag -T", "--threads: needs a value: --threads <N>"},
      // Decimal commas.
      {"encode a.nrrd --max-error 1,5", "such as 0.5" + hint},
      {"encode a.nrrd -M 1,5G", "-M: 1,5G: must be a number of bytes"},
      {"encode a.nrrd -M 1,5G", "such as 800M or 1.5G" + hint},
      {"encode a.nrrd -M 1,5X", "1.5G"},
      {"encode a.nrrd --range 0,5:3", "must be lo:hi or auto" + hint},
      {"preview a.tag --window 0:2,5", "must be lo:hi with lo < hi" + hint},
      {"encode a --dims 1,1,1 --type int8 --spacing 0,5,0,5,1",
       "must be one number above 0, or three of them (X,Y,Z), optionally with a unit: 10um, or "
       "0.5,0.5,1.25mm\n"},
      {"encode a.nrrd --spacing 0,5mm", "0.5,0.5,1.25mm" + hint},
      // Values.
      {"phantom --dims 4,4,4 --seed -1", "--seed: -1: must be a whole number"},
      {"phantom --dims 4,4,4 --seed 99999999999999999999", "below 2^64"},
      {"encode x --dims=1,1,1 --type=int8 --offset=-3", "--offset: -3: must be a whole number"},
      {"encode x --progress=foo", "--progress: foo: must be one of auto, bar, plain, none;"},
      {"encode x --endian middle", "--endian: middle: must be one of little, big;"},
      {"decode x --format png",
       "--format: png: must be one of nrrd, nhdr, raw, vdb, nifti, nifti.gz, metaimage, mhd, npy, tiff, vti, "
       "vtkhdf, hdf5, zarr;"}};
  for (const auto& [line, message] : wrong) fails(line, usage, message);
  EXPECT_FALSE(has(tagrid(words("encode a.nrrd -M 1,5X")).err, "comma"));
  EXPECT_LT(tagrid(words("decode x --format png")).err.size(), 170U);
}

TEST_F(Options, NamesAfterTwoDashesMayBeginWithOne) {
  phantom("volume.nrrd");
  expect_ok(script("mv volume.nrrd ./-x.nrrd"));
  works("encode -o a.tag -- -x.nrrd");
  works("encode ./-x.nrrd");
  expect_ok(script("cmp ./-x.tag a.tag"));
  works("info -- -x.tag");
  fails("encode -x.nrrd", usage, "unknown option -x.nrrd; for the file of this name, give ./-x.nrrd");
  // As elsewhere, there are no options after it.
  fails("encode -- -x.nrrd -o b.tag", usage, "give options before it");
}

TEST_F(Options, ValuesFollowASpaceAnEqualsSignOrAShortOptionAndTheLastCounts) {
  phantom("volume.nrrd");
  works("encode volume.nrrd --max-error 9 --max-error 3 -o space.tag");
  works("encode -T2 --max-error=3 volume.nrrd --output=equals.tag");
  works("encode -qk volume.nrrd -T2 -oa.tag --max-error=3");
  EXPECT_EQ(content("space.tag"), content("equals.tag"));
  EXPECT_EQ(content("space.tag"), content("a.tag"));
  EXPECT_EQ(info("space.tag")["max_error"], 3);
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
  EXPECT_EQ(info("bare.tag")["geometry"]["spacing"], nlohmann::json({1, 1, 3}));
}

TEST_F(Options, AVolumeWhereATagFileIsWantedIsToldToBeEncodedFirst) {
  phantom("volume.nrrd");
  phantom("volume.vdb", {"--type", "float32"});
  for (const char* command : {"decode", "info", "verify", "mesh"}) {
    expect_error(tagrid({command, "-"}, content("volume.nrrd")), broken_input,
                 "not a .tag file, but an NRRD volume; encode it first");
    expect_error(tagrid({command, "-"}, content("volume.vdb")), broken_input,
                 "but an OpenVDB file; encode it first");
  }
  fails("decode volume.nrrd", broken_input, "but an NRRD volume; encode it first");
}

TEST_F(Options, ValuesOutOfRangeAndCombinationsThatMakeNoSenseAreRefused) {
  phantom("volume.nrrd");
  const std::tuple<const char*, const char*, const char*> wrong[] = {
      {"", "--max-error", "-1 nan much inf 1e999 0x10 2,5"},
      {"", "--cube", "0x20 32.0 99999999999999999999 33 2 512"},
      {"", "-T", "1025 2x -1"},
      {"", "--range", "0:inf 0:1:2 5 5:5 5:x"},
      {"", "--effort", "most 2"},
      {"--type uint8", "--dims", "4,4 4,,4,4 4,4,4, 4,4,2147483649 0,4,4"},
      {"--dims 4,4,4 --type uint8", "--offset", "20000000000G"},
      {"--dims 4,4,4 --type uint8", "--spacing", "1,0,1"},
      {"--dims 4,4,4", "--type", "uint9"}};
  const auto refused = [&](const std::string& options) { fails("encode volume.nrrd " + options, usage, ""); };
  for (const auto& [others, option, values] : wrong)
    for (const std::string& value : words(values)) refused(others + std::string(" ") + option + " " + value);
  for (const char* options :
       {"--accuracy 2", "--max-level 16", "--brick 0", "--field-scale 0", "--offset -1", "--dims 4,4",
        "--surface-error 1", "--surface-error 2 --max-error 2", "--surface-error 1 --max-error 2 --grid-only",
        "--grid-only --max-level 6 --max-error 2", "--field-scale 0.1 --range 0:9", "--dims 4,4,4",
        "--type int16", "--spacing 1,1,2", "--spacing 1,1,1 --override-spacing 1,1,1", "--endian big",
        "--keep --rm"})
    refused(options);
  expect_error(tagrid({"encode", "volume.nrrd", "--max-error", " 2"}), usage, "");
  EXPECT_EQ(names(), std::vector<std::string>{"volume.nrrd"});
}

TEST_F(Options, BoundsThatAreRoundedDownToIntegersAreTold) {
  phantom("volume.nrrd");
  // Half a Hounsfield unit is five steps of 0.1.
  file("steps.nrrd",
       "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\nrescale_slope:=0.1\n\nabcdefgh");
  file("floats.raw", std::string(32, '\0'));
  const std::pair<const char*, const char*> said[] = {
      {"volume.nrrd --max-error 0.5", "--max-error 0.5: samples are integers, so this is 0 (lossless)\n"},
      {"volume.nrrd --max-error 2.5", "--max-error 2.5: samples are integers, so this is 2\n"},
      {"volume.nrrd --mesh-error 0.5", "--mesh-error 0.5: samples are integers, so this is 0\n"},
      {"volume.nrrd --max-error 3 --surface-error 1.5",
       "--surface-error 1.5: samples are integers, so this is 1\n"},
      {"volume.nrrd --grid-only --max-error 9.5", "--max-error 9.5: samples are integers, so this is 9\n"},
      {"volume.nrrd --max-error 2", ""},
      {"volume.nrrd --max-error 2.5 -q", ""},
      {"floats.raw --dims 2,2,2 --type float32 --max-error 0.5", ""}};
  for (const auto& [options, warning] : said) {
    const Ending ending = tagrid(words(std::string("encode -f ") + options));
    EXPECT_EQ(ending.code, 0) << options;
    EXPECT_EQ(ending.err, *warning ? std::string("tagrid: warning: volume.nrrd: ") + warning : "");
  }
  const Ending steps = tagrid(words("encode steps.nrrd --max-error 0.5"));
  EXPECT_EQ(steps.code, 0);
  EXPECT_FALSE(has(steps.err, "warning"));
}

TEST_F(Options, NumbersAreDecimalWhateverTheyBeginWithAndMayBeOfKibibytes) {
  works("phantom --dims 052,040,036 -o octal.nrrd -T 02");
  phantom("volume.nrrd");
  EXPECT_EQ(content("octal.nrrd"), content("volume.nrrd"));
  works("encode volume.nrrd --cube 016 --accuracy=020 -o zero.tag");
  works("encode volume.nrrd --cube 16 --max-error -0 -o none.tag");
  EXPECT_EQ(content("zero.tag"), content("none.tag"));
  file("more.raw", std::string(2048, 'x') + samples_of(content("volume.nrrd")));
  works("encode more.raw --offset 2K --dims 52,40,36 --type int16");
  EXPECT_EQ(out("decode more.tag -o -"), samples_of(content("volume.nrrd")));
}

TEST_F(Options, WhatContradictsAnNrrdHeaderIsRefused) {
  phantom("volume.nrrd");
  const std::string raw = " -o x.tag --dims 52,40,36 --type ";
  for (const std::string options : {"uint16", "int16 --endian big"})
    for (const std::string input : {"volume.nrrd", "-"})
      expect_error(tagrid(words("encode " + input + raw + options), content("volume.nrrd")), usage,
                   "its NRRD header ");
  works("encode volume.nrrd --endian=little --spacing=1,1,1" + raw + "int16");
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

TEST_F(Options, AnotherTypeOrOrderOfBytesOrDimsIsSuspected) {
  phantom("volume.raw");
  const std::pair<const char*, const char*> suspected[] = {
      {"52,40,36 --type int16 --endian big",
       "looks far more like a volume with --type int16 --endian little than with --type int16 "
       "--endian big; check the type and the byte order"},
      {"104,40,36 --type uint8", "looks far more like samples of 2 bytes"},
      {"40,52,36 --type int16", "--dims 52,40,36"},
      {"52,40,36 --type int16", ""},
      {"40,52,36 --type int16 -q", ""},
      {"52,40,36 --type int16 --endian big -q", ""}};
  for (const auto& [options, suspicion] : suspected) {
    const Ending ending = tagrid(words(std::string("encode volume.raw -f --dims ") + options));
    EXPECT_EQ(ending.code, 0);
    EXPECT_TRUE(*suspicion ? has(ending.err, suspicion) : testing::AssertionResult(ending.err.empty()))
        << options;
  }
}

TEST_F(Options, SamplesFarBeyondTheUsualRangeAreToldWhereAMeshIsAskedFor) {
  std::string samples;
  for (int i = 0; i < 20 * 20 * 20; ++i) {
    const int v = i % 20 * 3000;
    samples += {static_cast<char>(v & 255), static_cast<char>(v >> 8)};
  }
  file("wide.raw", samples);
  const std::string raw = " --dims 20,20,20 --type uint16", encode = "encode wide.raw -f" + raw;
  const std::string warning = "samples span 0 to 57000, but the grid was made for 0 to 4096";
  works(encode);
  fails("mesh wide.tag", 0, warning);
  fails(encode + " --grid-only", 0, warning);
  for (const char* more : {" --range auto", " --range 0:60000", " --field-scale 0.001"}) {
    works(encode + more);
    works("mesh wide.tag -f");
  }
  file("list.tsv", "wide.raw\n");
  works("convert --manifest list.tsv --output-dir out" + raw);
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
  fails("encode a.gz -o x.tag", broken_input,
        "-o a.tag`, with --dims and --type if the samples have no header");
  expect_ok(script("zcat a.gz | $TAGRID encode - > b.tag"));
  EXPECT_EQ(header_and_bricks(content("b.tag")), header_and_bricks(content("volume.tag")));
  // The advice is for the command that was given.
  fails("verify volume.tag --against a.gz", broken_input, "verify NAME.tag --against -");
  EXPECT_EQ(script("zcat a.gz | $TAGRID verify volume.tag --against -").code, 0);
}

}  // namespace
}  // namespace tagrid
