// Volumes that go through .tag files and back: every format, and wide types.
#include <cmath>

#include "tests/support/command_line.h"
#include "tests/support/tag_in_memory.h"

namespace tagrid {
namespace {

// A volume and its metadata come back as they went in.

class RoundTrip : public CommandLine {};

TEST_F(RoundTrip, OptionsSayWhatHeaderlessInputIs) {
  phantom("int16.raw");
  std::string swapped = content("int16.raw");
  for (std::size_t i = 0; i < swapped.size(); i += 2) std::swap(swapped[i], swapped[i + 1]);
  file("big.raw", "some header" + swapped);
  const std::string options = " --dims 52,40,36 --type int16 --offset 11 --endian big --spacing 0.4,0.4,1.25";
  works("encode big.raw" + options);
  works("decode big.tag");
  EXPECT_EQ(samples_of(content("big.nrrd")), content("int16.raw"));
  EXPECT_TRUE(has(content("big.nrrd"), "spacings: 0.4 0.4 1.25\n"));
  EXPECT_EQ(header_and_bricks(out("encode -" + options, content("big.raw"))),
            header_and_bricks(content("big.tag")));
}

TEST_F(RoundTrip, DetachedHeadersBothWays) {
  phantom("volume.nrrd");
  phantom("apart.nhdr");
  works("encode volume.nrrd");
  works("encode apart.nhdr");
  EXPECT_EQ(header_and_bricks(content("apart.tag")), header_and_bricks(content("volume.tag")));
  works("decode apart.tag -o again.nhdr");
  EXPECT_TRUE(has(content("again.nhdr"), "data file: again.raw\n"));
  EXPECT_EQ(content("again.raw"), content("apart.raw"));
}

TEST_F(RoundTrip, AVolumeInSeveralFilesIsEncodedAndRemovedAsOne) {
  phantom("volume.nhdr");
  const std::string all = content("volume.raw");
  const std::size_t size = all.size() / 4;
  for (std::size_t i = 0; i < 4; ++i) file("parts" + std::to_string(i) + ".raw", all.substr(i * size, size));
  expect_ok(script("sed 's/data file: .*/data file: parts%d.raw 0 3 1 3/' volume.nhdr > parts.nhdr"));
  works("encode parts.nhdr --rm --resume");
  EXPECT_EQ(names(), (std::vector<std::string>{"parts.tag", "volume.nhdr", "volume.raw"}));
  EXPECT_EQ(out("decode parts.tag -o -"), all);
}

TEST_F(RoundTrip, GzipInput) {
  phantom("int16.raw");
  const std::string known =
      "content: a scan\nspace: left-posterior-superior\n"
      "space directions: (0.5,0,0) (0,0.5,0) (0,0.1,-2.25)\nspace units: \"mm\" \"mm\" \"mm\"\n"
      "space origin: (-12.5,3,1e3)\nkinds: domain domain domain\n"
      "measurement frame: (1,0,0) (0,1,0) (0,0,1)\n# a remark\nModality:=CT\nkey with spaces:=a:=b\n";
  file("head", "NRRD0005\ntype: int16\ndimension: 3\nsizes: 52 40 36\nencoding: gzip\nendian: little\n" +
                   known + "\n");
  expect_ok(script("(cat head; gzip -c int16.raw) > packed.nrrd"));
  works("encode packed.nrrd");
  EXPECT_EQ(out("decode packed.tag -o -"), content("int16.raw"));
  // Only of a file is the plain form kept.
  EXPECT_EQ(header_and_bricks(out("encode -", content("packed.nrrd"))),
            header_and_bricks(content("packed.tag")));
  works("decode packed.tag -o out.nrrd");
  EXPECT_TRUE(has(content("out.nrrd"), known));
}

TEST_F(RoundTrip, TheFormatOptionGivesTheNameItsEnding) {
  make_tag();
  std::filesystem::create_directory(path("there"));
  std::filesystem::rename(path("volume.tag"), path("there/scan.tag"));
  for (const char* format : {"nrrd", "nhdr", "raw", "vdb"})
    works(std::string("decode there/scan.tag -f --format ") + format);
  EXPECT_EQ(content("there/scan.nrrd"), content("volume.nrrd"));
  EXPECT_EQ(content("there/scan.raw"), samples_of(content("volume.nrrd")));
  EXPECT_TRUE(content("there/scan.nhdr").starts_with("NRRD"));
  EXPECT_TRUE(content("there/scan.vdb").starts_with(" BDV"));
}

TEST_F(RoundTrip, TheFormatOptionDecidesWhereTheNameSaysNothing) {
  make_tag();
  works("decode volume.tag -o x.bin --format raw");
  works("decode volume.tag -o x.dat --format nrrd");
  EXPECT_EQ(content("x.dat"), content("volume.nrrd"));
  EXPECT_EQ(content("x.bin"), samples_of(content("x.dat")));
  works("decode volume.tag -o y.NRRD --format nrrd");
  EXPECT_EQ(tagrid({"decode", "volume.tag", "-o", "-", "--format", "nrrd"}).out, content("volume.nrrd"));
  works("decode volume.tag -o /dev/null --format nrrd");
}

TEST_F(RoundTrip, AFormatThatContradictsTheNameIsRefused) {
  make_tag();
  const std::vector<std::string> formats = {"nrrd", "nhdr", "raw", "vdb"};
  for (const std::string& format : formats)
    for (const std::string& ending : formats)
      for (const char* command : {"decode volume.tag", "phantom --dims 4,4,4"})
        if (format != ending)
          fails(command + (" --format " + format) + " -fo x." + ending, usage,
                "x." + ending + " is that of another format");
  EXPECT_EQ(names(), (std::vector<std::string>{"volume.nrrd", "volume.tag"}));
  // The advice works.
  works("decode volume.tag --format nrrd -o x.nrrd");
  works("decode volume.tag -o x.raw");
  fails("decode volume.tag -o x.png", usage, "must end in .nrrd");
}

// 32-bit integers and floats on the command line.

class WideTypes : public CommandLine {
 protected:
  /// Samples of float32, 52 x 40 x 36.
  template <class F>
  std::string floats(F f) const {
    std::string bytes;
    for (int i = 0; i < 52 * 40 * 36; ++i) {
      const auto v = static_cast<float>(f(i));
      char raw[4];
      std::memcpy(raw, &v, 4);
      bytes.append(raw, 4);
    }
    return bytes;
  }
};

TEST_F(WideTypes, APipeNeedsARangeOrAFieldScale) {
  for (const std::string type : {"uint32", "float64"}) {
    phantom("v.raw", {"--type", type, "-f"});
    const std::string raw = " --dims 52,40,36 --type " + type, samples = content("v.raw");
    expect_error(tagrid(words("encode -" + raw), samples), usage, "--range");
    // For auto, the samples are copied to find their range.
    for (const char* scale : {" --range auto", " --range -1024:3072", " --field-scale 0.002"}) {
      const std::string options = raw + " --max-error 3 -qf" + scale;
      works("encode v.raw -o v.tag" + options);
      EXPECT_EQ(header_and_bricks(content("v.tag")), header_and_bricks(out("encode -" + options, samples)))
          << "a file and a pipe give the same bricks";
      works("verify v.tag -q --against v.raw" + raw);
    }
  }
}

TEST_F(WideTypes, JsonHasNumbersOrNullWhateverTheSamplesAre) {
  const auto nan = [](int) { return std::nan(""); };
  const auto huge = [](int i) { return i % 2 ? 3e38 : -3e38; };
  const auto mixed = [](int i) { return i % 5 == 0 ? INFINITY : std::sin(i * 0.01); };
  for (const std::string& samples : {floats(nan), floats(huge), floats(mixed)})
    for (const std::string options : {"", "--max-error 0.5", "--grid-only", "--max-error 1e300"}) {
      file("v.raw", samples);
      works("encode v.raw -qf --json run.json --dims 52,40,36 --type float32 " + options);
      for (const nlohmann::json& achieved : {info("v.tag")["achieved"], json_of("run.json")["achieved"]}) {
        for (const char* key : {"max_error", "rmse", "psnr"})
          EXPECT_TRUE(achieved[key].is_number() || achieved[key].is_null()) << key;
        if (options.empty()) {
          EXPECT_EQ(achieved["max_error"], 0);
          EXPECT_TRUE(achieved["psnr"].is_null());
        }
      }
    }
}

TEST_F(WideTypes, AnErrorAboveTheBoundIsFoundByVerify) {
  const std::string raw = " --dims 52,40,36 --type float32",
                    samples = floats([](int i) { return std::sin(i * 0.01); });
  file("v.raw", samples);
  works("encode v.raw -q --max-error 0.001" + raw);
  for (const float wrong : {0.1F, std::nanf(""), INFINITY}) {
    std::string other = samples;
    std::memcpy(other.data() + 4 * 5000, &wrong, 4);
    file("other.raw", other);
    fails("verify v.tag --against other.raw" + raw, broken_input, "voxel");
  }
}

// OpenVDB files as input and output on the command line.

class Vdb : public CommandLine {
 protected:
  std::string print(const std::string& name) const { return script("vdb_print -l " + name).out; }
};

TEST_F(Vdb, AVolumeComesBackThroughAGridWithAllThatWasKnownOfIt) {
  for (const std::string type : {"uint8", "int16", "uint32", "float32"}) {
    phantom("v.nrrd", {"--type", type, "-f"});
    works("encode v.nrrd -f");
    works("decode v.tag -fo v.vdb");
    works("encode v.vdb -fo again.tag");
    EXPECT_EQ(header_and_bricks(content("again.tag")), header_and_bricks(content("v.tag"))) << type;
    out("verify v.tag --against v.vdb");
  }
}

TEST_F(Vdb, APipeGetsWhatAFileGets) {
  make_tag();
  works("decode volume.tag -o a.vdb");
  const Ending ending = tagrid({"decode", "-", "--format", "vdb"}, content("volume.tag"));
  expect_ok(ending);
  EXPECT_EQ(ending.out, content("a.vdb"));
  expect_error(tagrid({"encode", "-"}, ending.out), usage, "save it to one first");
}

TEST_F(Vdb, AToleranceAddsToTheBoundAndIsTold) {
  make_tag({"--max-error", "5"});
  const Ending ending = tagrid({"decode", "volume.tag", "-o", "a.vdb", "--vdb-grid", "scan",
                                "--vdb-background", "-1000", "--vdb-tolerance", "50", "--json", "a.json"});
  EXPECT_EQ(ending.code, 0);
  EXPECT_TRUE(has(ending.err, "within 55 of the original"));
  const nlohmann::json vdb = json_of("a.json")["settings"]["vdb"];
  EXPECT_EQ(vdb["max_error"], 55);
  EXPECT_EQ(vdb["tolerance"], 50);
  EXPECT_EQ(vdb["background"], -1000);
  const std::string text = print("a.vdb");
  for (const char* line : {"Name: scan\n", "Background value: -1000\n", "tagrid_max_error: 55\n", "float"})
    EXPECT_TRUE(has(text, line));
  // Every voxel is within both bounds together, and no active one is near the background.
  works("encode a.vdb -o b.tag --vdb-grid scan");
  const std::string original = samples_of(content("volume.nrrd"));
  const std::string samples = tagrid({"decode", "b.tag", "-o", "-"}).out;
  ASSERT_EQ(samples.size(), original.size());
  std::uint64_t active = 0;
  for (std::size_t i = 0; i < samples.size(); i += 2) {
    std::int16_t before, after;
    std::memcpy(&before, original.data() + i, 2);
    std::memcpy(&after, samples.data() + i, 2);
    ASSERT_LE(std::abs(before - after), 55);
    ASSERT_TRUE(after == -1000 || std::abs(after + 1000) > 50) << after;
    active += after != -1000;
  }
  EXPECT_EQ(vdb["active_voxels"], active);
  EXPECT_EQ(tagrid({"decode", "volume.tag", "-o", "c.vdb", "--vdb-tolerance", "1", "-q"}).err, "");
}

TEST_F(Vdb, TheTypeOfAGridCanBeChosenWhereNothingIsLost) {
  make_tag();
  works("decode volume.tag -o a.vdb --vdb-type int32");
  works("decode volume.tag -o b.vdb --vdb-type float");
  works("decode volume.tag -o c.vdb");
  EXPECT_TRUE(has(print("a.vdb"), "Tree_int32_5_4_3"));
  EXPECT_TRUE(has(print("b.vdb"), "Tree_float_5_4_3"));
  EXPECT_TRUE(content("b.vdb") == content("c.vdb"));
  for (const char* grid : {"a.vdb", "b.vdb"})
    expect_ok(tagrid({"verify", "volume.tag", "--against", grid, "-q"}));
  fails("decode volume.tag -o d.vdb --vdb-type double", usage, "--vdb-type");
  fails("decode volume.tag -o d.nrrd --vdb-type float", usage, "-o FILE.vdb");
  file("f.raw", std::string(27 * 4, '\1'));
  works("encode f.raw --dims 3,3,3 --type float32 -o f.tag");
  fails("decode f.tag -o f.vdb --vdb-type int32", usage, "cannot be stored exactly as int32");
}

TEST_F(Vdb, WhatMakesNoSenseIsRefusedAndNothingIsLeft) {
  make_tag();
  fails("decode volume.tag -o a.nrrd --vdb-grid x", usage, "-o FILE.vdb");
  fails("decode volume.tag -o a.vdb --vdb-tolerance -1", usage, "negative");
  fails("decode volume.tag -o a.vdb --vdb-background 0.5", usage, "is not a value of type int16");
  fails("encode volume.nrrd -o b.tag --vdb-grid x", usage, "not an OpenVDB file");
  works("decode volume.tag -o a.vdb");
  fails("encode a.vdb --vdb-grid other", usage, "has no grid other; it has density");
  expect_error(tagrid(with({"encode", "a.vdb"}, raw_)), usage, "--dims");
  // The set of active voxels would be lost.
  fails("encode a.vdb --rm", usage, "could not be restored byte for byte");
  file("broken.vdb", content("a.vdb").substr(0, 5000));
  fails("encode broken.vdb", broken_input, "OpenVDB file");
  const std::string before = content("a.vdb");
  fails("decode volume.tag -o a.vdb", usage, "already exists");
  fails("decode volume.tag -o nowhere/a.vdb", world, "nowhere/a.vdb");
  EXPECT_EQ(content("a.vdb"), before);
  EXPECT_EQ(names(), (std::vector<std::string>{"a.vdb", "broken.vdb", "volume.nrrd", "volume.tag"}));
}

}  // namespace
}  // namespace tagrid
