// Volumes that go through .tag files and back: every format, and wide types.
#include <cmath>

#include "tests/support/command_line.h"
#include "tests/support/tag_in_memory.h"

namespace tagrid {
namespace {

// A volume and its metadata come back as they went in.

class RoundTrip : public CommandLine {
 protected:
  /// A header for the samples of volume.raw.
  static std::string header(const std::string& type, const std::string& storage, const std::string& more) {
    return "NRRD0005\ntype: " + type + "\ndimension: 3\nsizes: 52 40 36\n" + storage + more + "\n";
  }
  std::string raw(const std::string& type) const {
    phantom(type + ".raw", {"--type", type});
    return content(type + ".raw");
  }
  static std::string byte_swapped(std::string samples, std::size_t size) {
    for (std::size_t i = 0; i < samples.size(); i += size)
      std::reverse(samples.begin() + static_cast<std::ptrdiff_t>(i),
                   samples.begin() + static_cast<std::ptrdiff_t>(i + size));
    return samples;
  }
  static constexpr const char* known =
      "content: a scan\nspace: left-posterior-superior\n"
      "space directions: (0.5,0,0) (0,0.5,0) (0,0.1,-2.25)\nspace units: \"mm\" \"mm\" \"mm\"\n"
      "space origin: (-12.5,3,1e3)\nkinds: domain domain domain\n"
      "measurement frame: (1,0,0) (0,1,0) (0,0,1)\n# a remark\nModality:=CT\nkey with spaces:=a:=b\n";
};

TEST_F(RoundTrip, EveryTypeIsLosslessByDefault) {
  for (const std::string type :
       {"uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64"}) {
    const std::string samples = raw(type);
    expect_ok(tagrid({"encode", type + ".raw", "--dims", "52,40,36", "--type", type}));
    EXPECT_EQ(tagrid({"decode", type + ".tag", "-o", "-"}).out, samples) << type;
    EXPECT_EQ(nlohmann::json::parse(tagrid({"info", type + ".tag", "--json"}).out)["type"], type);
  }
}

TEST_F(RoundTrip, TheSpacingOfHeaderlessInputIsKept) {
  raw("int16");
  expect_ok(tagrid(with({"encode", "int16.raw", "--spacing", "0.4,0.4,1.25"}, raw_)));
  expect_ok(tagrid({"decode", "int16.tag"}));
  EXPECT_TRUE(has(content("int16.nrrd"), "spacings: 0.4 0.4 1.25\n"));
}

TEST_F(RoundTrip, DetachedHeadersBothWays) {
  phantom("volume.nrrd");
  phantom("apart.nhdr");
  expect_ok(tagrid({"encode", "volume.nrrd"}));
  expect_ok(tagrid({"encode", "apart.nhdr"}));
  EXPECT_EQ(header_and_bricks(content("apart.tag")), header_and_bricks(content("volume.tag")));
  expect_ok(tagrid({"decode", "apart.tag", "-o", "again.nhdr"}));
  EXPECT_TRUE(has(content("again.nhdr"), "data file: again.raw\n"));
  EXPECT_EQ(content("again.raw"), content("apart.raw"));
}

TEST_F(RoundTrip, AVolumeInSeveralFilesIsEncodedAndRemovedAsOne) {
  phantom("volume.nhdr");
  const std::string all = content("volume.raw");
  expect_ok(tagrid({"encode", "volume.nhdr", "--max-error", "3"}));
  const std::size_t slices = 4, size = all.size() / slices;
  for (std::size_t i = 0; i < slices; ++i)
    file("parts" + std::to_string(i) + ".raw", all.substr(i * size, size));
  expect_ok(script("sed 's/data file: .*/data file: parts%d.raw 0 3 1 3/' volume.nhdr > parts.nhdr"));
  expect_ok(tagrid({"encode", "parts.nhdr", "--max-error", "3", "-T1"}));
  EXPECT_EQ(header_and_bricks(content("parts.tag")), header_and_bricks(content("volume.tag")));
  expect_ok(tagrid({"verify", "parts.tag", "--against", "parts.nhdr"}));
  expect_ok(tagrid({"encode", "parts.nhdr", "--rm", "--resume", "-f"}));
  for (const char* name : {"parts.nhdr", "parts0.raw", "parts1.raw", "parts2.raw", "parts3.raw"})
    EXPECT_FALSE(std::filesystem::exists(path(name))) << name;
  EXPECT_EQ(tagrid({"decode", "parts.tag", "-o", "-"}).out, all);
}

TEST_F(RoundTrip, BigEndianInputComesBackLittleEndian) {
  const std::string samples = raw("int16");
  file("big.nrrd", header("int16", "encoding: raw\nendian: big\n", "") + byte_swapped(samples, 2));
  expect_ok(tagrid({"encode", "big.nrrd"}));
  EXPECT_EQ(tagrid({"decode", "big.tag", "-o", "-"}).out, samples);
  file("big.raw", byte_swapped(samples, 2));
  expect_ok(tagrid(with({"encode", "big.raw", "-o", "raw.tag", "--endian", "big"}, raw_)));
  EXPECT_EQ(tagrid({"decode", "raw.tag", "-o", "-"}).out, samples);
}

TEST_F(RoundTrip, GzipInput) {
  const std::string samples = raw("int16");
  file("head", header("int16", "encoding: gzip\nendian: little\n", known));
  expect_ok(script("(cat head; gzip -c int16.raw) > packed.nrrd"));
  expect_ok(tagrid({"encode", "packed.nrrd"}));
  EXPECT_EQ(tagrid({"decode", "packed.tag", "-o", "-"}).out, samples);
  // Only of a file is the plain form kept.
  EXPECT_EQ(header_and_bricks(tagrid({"encode", "-"}, content("packed.nrrd")).out),
            header_and_bricks(content("packed.tag")));
  expect_ok(tagrid({"decode", "packed.tag", "-o", "out.nrrd"}));
  EXPECT_TRUE(has(content("out.nrrd"), known));
}

TEST_F(RoundTrip, AnOffsetSkipsTheStartOfHeaderlessInput) {
  const std::string samples = raw("int16");
  file("offset.raw", "some header" + samples);
  expect_ok(tagrid(with({"encode", "offset.raw", "--offset", "11"}, raw_)));
  EXPECT_EQ(tagrid({"decode", "offset.tag", "-o", "-"}).out, samples);
  const Ending piped = tagrid(with({"encode", "-", "--offset=11"}, raw_), content("offset.raw"));
  EXPECT_EQ(header_and_bricks(piped.out), header_and_bricks(content("offset.tag")));
}

TEST_F(RoundTrip, TheFormatOptionGivesTheNameItsEnding) {
  make_tag();
  std::filesystem::create_directory(path("there"));
  std::filesystem::rename(path("volume.tag"), path("there/scan.tag"));
  expect_ok(tagrid({"decode", "there/scan.tag"}));
  for (const std::string format : {"nrrd", "nhdr", "raw", "vdb"})
    expect_ok(tagrid({"decode", "there/scan.tag", "--format", format, "-f"}));
  EXPECT_EQ(content("there/scan.nrrd"), content("volume.nrrd"));
  EXPECT_EQ(content("there/scan.raw"), samples_of(content("volume.nrrd")));
  EXPECT_TRUE(content("there/scan.nhdr").starts_with("NRRD"));
  EXPECT_TRUE(content("there/scan.vdb").starts_with(" BDV"));
}

TEST_F(RoundTrip, TheFormatOptionDecidesWhereTheNameSaysNothing) {
  make_tag();
  expect_ok(tagrid({"decode", "volume.tag", "-o", "x.bin", "--format", "raw"}));
  expect_ok(tagrid({"decode", "volume.tag", "-o", "x.dat", "--format", "nrrd"}));
  EXPECT_EQ(content("x.dat"), content("volume.nrrd"));
  EXPECT_EQ(content("x.bin"), samples_of(content("x.dat")));
  expect_ok(tagrid({"decode", "volume.tag", "-o", "y.NRRD", "--format", "nrrd"}));
  EXPECT_EQ(tagrid({"decode", "volume.tag", "-o", "-", "--format", "nrrd"}).out, content("volume.nrrd"));
  expect_ok(tagrid({"decode", "volume.tag", "-o", "/dev/null", "--format", "nrrd"}));
}

TEST_F(RoundTrip, AFormatThatContradictsTheNameIsRefused) {
  make_tag();
  const std::vector<std::string> formats = {"nrrd", "nhdr", "raw", "vdb"};
  for (const std::string& format : formats)
    for (const std::string& ending : formats) {
      if (format == ending) continue;
      for (const Arguments& command : {Arguments{"decode", "volume.tag"}, {"phantom", "--dims", "4,4,4"}})
        expect_error(tagrid(with(command, {"--format", format, "-fo", "x." + ending})), usage,
                     "x." + ending + " is that of another format");
    }
  EXPECT_EQ(names(), (std::vector<std::string>{"volume.nrrd", "volume.tag"}));
  // The advice works.
  expect_ok(tagrid({"decode", "volume.tag", "--format", "nrrd", "-o", "x.nrrd"}));
  expect_ok(tagrid({"decode", "volume.tag", "-o", "x.raw"}));
  expect_error(tagrid({"decode", "volume.tag", "-o", "x.png"}), usage, "must end in .nrrd");
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
  const Arguments float_raw_ = {"--dims", "52,40,36", "--type", "float32"};
};

TEST_F(WideTypes, APipeNeedsARangeOrAFieldScale) {
  for (const char* type : {"uint32", "int32", "float32", "float64"}) {
    phantom("v.raw", {"--type", type, "-f"});
    const Arguments raw = {"--dims", "52,40,36", "--type", type};
    const std::string samples = content("v.raw");
    expect_error(tagrid(with({"encode", "-"}, raw), samples), usage, "--range");
    // The samples are copied to find their range.
    const Ending ranged = tagrid(with({"encode", "-", "-q", "--range", "auto"}, raw), samples);
    expect_ok(ranged);
    expect_ok(tagrid(with({"encode", "v.raw", "-fqo", "v.tag"}, raw)));
    EXPECT_EQ(header_and_bricks(content("v.tag")), header_and_bricks(ranged.out));
    for (const Arguments& scale : {Arguments{"--range", "-1024:3072"}, Arguments{"--field-scale", "0.002"}}) {
      const Ending piped = tagrid(with(with({"encode", "-", "--max-error", "3"}, raw), scale), samples);
      expect_ok(piped);
      expect_ok(tagrid(with(with({"encode", "v.raw", "--max-error", "3", "-fo", "v.tag"}, raw), scale)));
      EXPECT_EQ(header_and_bricks(content("v.tag")), header_and_bricks(piped.out))
          << "a file and a pipe give the same bricks";
      expect_ok(tagrid(with({"verify", "v.tag", "-q", "--against", "v.raw"}, raw)));
    }
  }
}

TEST_F(WideTypes, JsonHasNumbersOrNullWhateverTheSamplesAre) {
  const auto nan = [](int) { return std::nan(""); };
  const auto huge = [](int i) { return i % 2 ? 3e38 : -3e38; };
  const auto mixed = [](int i) { return i % 5 == 0 ? INFINITY : std::sin(i * 0.01); };
  for (const std::string& samples : {floats(nan), floats(huge), floats(mixed)})
    for (const Arguments& options :
         {Arguments{}, {"--max-error", "0.5"}, {"--grid-only"}, {"--max-error", "1e300"}}) {
      file("v.raw", samples);
      expect_ok(tagrid(with(with({"encode", "v.raw", "-qf", "--json", "run.json"}, float_raw_), options)));
      const Ending info = tagrid({"info", "v.tag", "--json"});
      expect_ok(info);
      for (const nlohmann::json& achieved :
           {nlohmann::json::parse(info.out)["achieved"], json_of("run.json")["achieved"]}) {
        for (const char* key : {"max_error", "rmse", "psnr"})
          EXPECT_TRUE(achieved[key].is_number() || achieved[key].is_null()) << key;
        if (options.empty()) {
          EXPECT_EQ(achieved["max_error"], 0);
          EXPECT_TRUE(achieved["psnr"].is_null());
        }
      }
      expect_ok(tagrid(with({"verify", "v.tag", "-q", "--against", "v.raw"}, float_raw_)));
    }
}

TEST_F(WideTypes, AnErrorAboveTheBoundIsFoundByVerify) {
  const std::string samples = floats([](int i) { return std::sin(i * 0.01); });
  file("v.raw", samples);
  expect_ok(tagrid(with({"encode", "v.raw", "-q", "--max-error", "0.001"}, float_raw_)));
  for (const float wrong : {0.1F, std::nanf(""), INFINITY}) {
    std::string other = samples;
    std::memcpy(other.data() + 4 * 5000, &wrong, 4);
    file("other.raw", other);
    expect_error(tagrid(with({"verify", "v.tag", "--against", "other.raw"}, float_raw_)), broken_input,
                 "voxel");
  }
}

// OpenVDB files as input and output on the command line.

class Vdb : public CommandLine {
 protected:
  std::string print(const std::string& name) const { return script("vdb_print -l " + name).out; }
};

TEST_F(Vdb, AVolumeComesBackThroughAGridWithAllThatWasKnownOfIt) {
  for (const std::string type : {"uint8", "int16", "uint32", "float32"}) {
    phantom(type + ".nrrd", {"--type", type});
    expect_ok(tagrid({"encode", type + ".nrrd"}));
    expect_ok(tagrid({"decode", type + ".tag", "-o", type + ".vdb"}));
    expect_ok(tagrid({"encode", type + ".vdb", "-o", "again.tag", "-f"}));
    EXPECT_EQ(header_and_bricks(content("again.tag")), header_and_bricks(content(type + ".tag"))) << type;
    EXPECT_EQ(tagrid({"verify", type + ".tag", "--against", type + ".vdb"}).code, 0) << type;
  }
}

TEST_F(Vdb, APipeGetsWhatAFileGets) {
  make_tag();
  expect_ok(tagrid({"decode", "volume.tag", "-o", "a.vdb"}));
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
  expect_ok(tagrid({"encode", "a.vdb", "-o", "b.tag", "--vdb-grid", "scan"}));
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
  expect_ok(tagrid({"decode", "volume.tag", "-o", "a.vdb", "--vdb-type", "int32"}));
  expect_ok(tagrid({"decode", "volume.tag", "-o", "b.vdb", "--vdb-type", "float"}));
  expect_ok(tagrid({"decode", "volume.tag", "-o", "c.vdb"}));
  EXPECT_TRUE(has(print("a.vdb"), "Tree_int32_5_4_3"));
  EXPECT_TRUE(has(print("b.vdb"), "Tree_float_5_4_3"));
  EXPECT_TRUE(content("b.vdb") == content("c.vdb"));
  for (const char* grid : {"a.vdb", "b.vdb"})
    expect_ok(tagrid({"verify", "volume.tag", "--against", grid, "-q"}));
  expect_error(tagrid({"decode", "volume.tag", "-o", "d.vdb", "--vdb-type", "double"}), usage, "--vdb-type");
  expect_error(tagrid({"decode", "volume.tag", "-o", "d.nrrd", "--vdb-type", "float"}), usage, "-o FILE.vdb");
  file("f.raw", std::string(27 * 4, '\1'));
  expect_ok(tagrid({"encode", "f.raw", "--dims", "3,3,3", "--type", "float32", "-o", "f.tag"}));
  expect_error(tagrid({"decode", "f.tag", "-o", "f.vdb", "--vdb-type", "int32"}), usage,
               "cannot be stored exactly as int32");
}

TEST_F(Vdb, WhatMakesNoSenseIsRefused) {
  make_tag();
  expect_error(tagrid({"decode", "volume.tag", "-o", "a.nrrd", "--vdb-grid", "x"}), usage, "-o FILE.vdb");
  expect_error(tagrid({"decode", "volume.tag", "-o", "a.vdb", "--vdb-tolerance", "-1"}), usage, "negative");
  expect_error(tagrid({"decode", "volume.tag", "-o", "a.vdb", "--vdb-background", "0.5"}), usage,
               "is not a value of type int16");
  expect_error(tagrid({"encode", "volume.nrrd", "-o", "b.tag", "--vdb-grid", "x"}), usage,
               "not an OpenVDB file");
  expect_ok(tagrid({"decode", "volume.tag", "-o", "a.vdb"}));
  expect_error(tagrid({"encode", "a.vdb", "--vdb-grid", "other"}), usage,
               "has no grid other; it has density");
  expect_error(tagrid(with({"encode", "a.vdb"}, raw_)), usage, "--dims");
  // The set of active voxels would be lost.
  expect_error(tagrid({"encode", "a.vdb", "--rm"}), usage, "could not be restored byte for byte");
  file("broken.vdb", content("a.vdb").substr(0, 5000));
  expect_error(tagrid({"encode", "broken.vdb"}), broken_input, "OpenVDB file");
  EXPECT_EQ(names(), (std::vector<std::string>{"a.vdb", "broken.vdb", "volume.nrrd", "volume.tag"}));
}

TEST_F(Vdb, NothingIsLeftWhereTheOutputCannotBe) {
  make_tag();
  expect_ok(tagrid({"decode", "volume.tag", "-o", "a.vdb"}));
  const std::string before = content("a.vdb");
  expect_error(tagrid({"decode", "volume.tag", "-o", "a.vdb"}), usage, "already exists");
  expect_error(tagrid({"decode", "volume.tag", "-o", "nowhere/a.vdb"}), world, "nowhere/a.vdb");
  EXPECT_EQ(content("a.vdb"), before);
  EXPECT_EQ(names(), (std::vector<std::string>{"a.vdb", "volume.nrrd", "volume.tag"}));
}

}  // namespace
}  // namespace tagrid
