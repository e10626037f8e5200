// What the commands of an archive say of its volumes, and what `convert` does about it.
#include "tests/support/conversions.h"

namespace tagrid {
namespace {

class ArchiveStates : public Conversions<CommandLine> {
 protected:
  Ending archive(const std::string& action, const Arguments& more = {}) const {
    return tagrid(this->with(Arguments{"archive", action, "out"}, more));
  }
  /// Changes bytes in the middle of a file, which keeps its size and time.
  void rot(const std::string& name) const {
    const auto time = std::filesystem::last_write_time(path(name));
    std::string bytes = content(name);
    for (std::size_t i = bytes.size() / 2; i < bytes.size() / 2 + 8; ++i)
      bytes[i] = static_cast<char>(bytes[i] ^ 1);
    file(name, bytes);
    std::filesystem::last_write_time(path(name), time);
  }
};

TEST_F(ArchiveStates, WhatACheckFoundDamagedIsNotSkipped) {
  converted(2);
  const std::string good = content("out/a.tag"), original = content("a.nrrd");
  for (const Arguments& options : {Arguments{"--skip-done"}, {"--skip-done", "-f"}}) {
    rot("out/a.tag");
    const Ending check = archive("check");
    EXPECT_EQ(check.code, broken_input);
    EXPECT_TRUE(has(check.err, "1 of 2 checked volumes is not intact")) << check.err;
    const Ending repair = archive("repair");
    EXPECT_EQ(repair.code, broken_input);
    EXPECT_TRUE(has(repair.err,
                    "1 volume could not be repaired; restore it from a copy, or remove it and convert again "
                    "with --skip-done if its original is still there"))
        << repair.err;
    const std::string damaged = content("out/a.tag");
    const Ending refused = convert(options);
    EXPECT_EQ(refused.code, broken_input);
    const std::string advice =
        "repair it with tagrid archive repair out, or remove it to encode " + path("a.nrrd") + " again";
    EXPECT_TRUE(has(refused.err, "out/a.tag: the last check found it damaged; " + advice)) << refused.err;
    EXPECT_EQ(statuses(2), "a failed, b skipped");
    EXPECT_TRUE(content("out/a.tag") == damaged);
    std::filesystem::remove(path("out/a.tag"));
    expect_ok(convert(options));
    EXPECT_EQ(statuses(2), "a ok, b skipped");
    EXPECT_FALSE(last()["compared"]);
    EXPECT_TRUE(content("out/a.tag") == good);
    EXPECT_TRUE(content("a.nrrd") == original);
    // The check was of the older file.
    expect_ok(convert(options));
    EXPECT_EQ(statuses(2), "a skipped, b skipped");
    expect_ok(archive("check"));
  }
}

TEST_F(ArchiveStates, ADamagedOutputIsRepairedThoughItsOriginalIsDamagedToo) {
  converted(1, {"--parity", "30%"});
  const std::string good = content("out/a.tag");
  rot("out/a.tag");
  rot("a.nrrd");
  EXPECT_EQ(archive("check").code, broken_input);
  EXPECT_EQ(convert({"--parity", "30%", "--skip-done"}).code, broken_input);
  expect_ok(archive("repair"));
  EXPECT_TRUE(content("out/a.tag") == good);
}

TEST_F(ArchiveStates, WhatWasRepairedSinceIsDone) {
  converted(1, {"--parity", "30%"});
  rot("out/a.tag");
  EXPECT_EQ(archive("check").code, broken_input);
  expect_ok(archive("repair"));
  expect_ok(convert({"--parity", "30%", "--skip-done"}));
  EXPECT_EQ(statuses(1), "a skipped");
}

TEST_F(ArchiveStates, ARepairThatFailsIsACheck) {
  converted(1);
  rot("out/a.tag");
  EXPECT_EQ(archive("repair", {"a.tag"}).code, broken_input);
  EXPECT_EQ(convert({"--skip-done"}).code, broken_input);
  EXPECT_EQ(statuses(1), "a failed");
}

TEST_F(ArchiveStates, ACopyThatWasRestoredIsDone) {
  converted(1);
  const std::string good = content("out/a.tag");
  rot("out/a.tag");
  EXPECT_EQ(archive("check").code, broken_input);
  file("out/a.tag", good);
  expect_ok(convert({"--skip-done"}));
  EXPECT_EQ(statuses(1), "a skipped");
}

TEST_F(ArchiveStates, ADamagedOnlyCopyIsNotReplaced) {
  converted(1);
  expect_ok(convert({"--remove-verified"}));
  rot("out/a.tag");
  const std::string damaged = content("out/a.tag");
  EXPECT_EQ(archive("check").code, broken_input);
  volume("a.nrrd", 7);
  for (const Arguments& options : {Arguments{"--skip-done"}, {"--skip-done", "-f"}, {"-f"}})
    EXPECT_EQ(convert(options).code, broken_input);
  EXPECT_TRUE(content("out/a.tag") == damaged);
}

TEST_F(ArchiveStates, ChecksThatCannotBeReadSayNothing) {
  converted(1);
  file("out/events.jsonl", "not an event\n{\"event\": \"other\"}\n{\"event\": \"check\"}\n");
  std::filesystem::create_directory(path("out/events-old.jsonl"));
  expect_ok(convert({"--skip-done"}));
  EXPECT_EQ(statuses(1), "a skipped");
}

TEST_F(ArchiveStates, ARefusedExportOfAnIntactVolumeAdvisesNoRepair) {
  converted(1, {"--parity", "30%"});
  const Arguments dicom = {"a.tag", "--format", "dicom", "-o", "exported"};
  const Ending refused = archive("export", dicom);
  EXPECT_EQ(refused.code, broken_input);
  EXPECT_TRUE(has(refused.err, "choose another format, such as nrrd or nifti")) << refused.err;
  EXPECT_FALSE(has(refused.err, "tagrid repair")) << refused.err;
  rot("out/a.tag");
  EXPECT_TRUE(has(archive("export", dicom).err, "tagrid repair out/a.tag"));
}

TEST_F(ArchiveStates, AListNamesAnUnreadableFileOnce) {
  converted(1);
  file("out/a.tag", "this is something else");
  const std::string list = archive("list").out;
  EXPECT_TRUE(has(list, "  a.tag: this is not a .tag file")) << list;
  EXPECT_FALSE(has(list, "out/a.tag")) << list;
}

}  // namespace
}  // namespace tagrid
