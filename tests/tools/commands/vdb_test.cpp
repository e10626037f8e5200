// OpenVDB files as input and output on the command line.

#include <cmath>
#include <cstdint>
#include <cstring>

#include "tests/support/command_line.h"
#include "tests/support/tag_in_memory.h"

namespace tagrid {
namespace {

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
