// Files that are written: complete or not at all, and none left behind.
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <cstring>

#include "io/errors/errors.h"
#include "io/files/output_file.h"
#include "io/files/output_folder.h"
#include "io/files/spool_file.h"
#include "io/files/temporaries.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

using OutputFileTest = TemporaryFolder;
using Names = std::vector<std::string>;

TEST_F(OutputFileTest, AppearsOnCommitAndNotBefore) {
  OutputFile out(path("a.tag"), false);
  out.write("hello ");
  out.write("world");
  EXPECT_EQ(out.position(), 11u);
  ASSERT_EQ(names().size(), 1u);
  EXPECT_TRUE(names()[0].starts_with(".a.tag.part")) << names()[0];
  out.write_at(0, std::as_bytes(std::span("J", 1)));
  out.commit();
  EXPECT_EQ(names(), Names{"a.tag"});
  EXPECT_EQ(content("a.tag"), "Jello world");
}

TEST_F(OutputFileTest, NothingIsLeftWithoutCommit) {
  { OutputFile(path("a.tag"), false).write("x"); }
  EXPECT_EQ(names(), Names{});
  file("b.tag", "old");
  { OutputFile(path("b.tag"), true).write("new"); }
  EXPECT_EQ(names(), Names{"b.tag"});
  EXPECT_EQ(content("b.tag"), "old");
}

TEST_F(OutputFileTest, AnExistingFileIsOverwrittenOnlyWhenAsked) {
  file("a.tag", "old");
  EXPECT_THROW(OutputFile(path("a.tag"), false), UsageError);
  OutputFile out(path("a.tag"), true);
  out.write("new");
  EXPECT_EQ(content("a.tag"), "old");
  out.commit();
  EXPECT_EQ(content("a.tag"), "new");
  EXPECT_EQ(names(), Names{"a.tag"});
}

TEST_F(OutputFileTest, AFileThatAppearsMeanwhileIsKept) {
  {
    OutputFile out(path("a.tag"), false);
    out.write("new");
    file("a.tag", "somebody else's");
    EXPECT_THROW(out.commit(), UsageError);
  }
  EXPECT_EQ(content("a.tag"), "somebody else's");
  EXPECT_EQ(names(), Names{"a.tag"});
}

TEST_F(OutputFileTest, FoldersMissingFoldersAndDanglingLinksAreRefused) {
  EXPECT_THROW(OutputFile(folder_.string(), true), UsageError);
  EXPECT_TRUE(has(message_of<WorldError>([&] { OutputFile(path("gone/a.tag"), false); }), "gone/a.tag"));
  std::filesystem::create_symlink("nowhere", path("a.tag"));
  EXPECT_THROW(OutputFile(path("a.tag"), false), UsageError);
}

TEST_F(OutputFileTest, ALongNameIsPossible) {
  const std::string name(255, 'x');
  OutputFile out(path(name), false);
  out.commit();
  EXPECT_EQ(names(), Names{name});
}

TEST_F(OutputFileTest, HasTheModeOfAnyNewFile) {
  const mode_t mask = umask(022);
  OutputFile(path("a.tag"), false).commit();
  umask(mask);
  struct stat status;
  ASSERT_EQ(stat(path("a.tag").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0644u);
}

TEST_F(OutputFileTest, DevicesAreWrittenStraightAndAFullDiskIsAnErrorOfTheWorld) {
  OutputFile out("/dev/null", false);
  out.write("x");
  out.commit();
  EXPECT_TRUE(std::filesystem::exists("/dev/null"));
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  OutputFile full("/dev/full", false);
  const std::string message = message_of<WorldError>([&] { full.write("x"); });
  EXPECT_TRUE(has(message, "/dev/full") && has(message, "space"));
}

TEST_F(OutputFileTest, ASignalHandlerCanRemoveAllTemporaries) {
  OutputFile a(path("a"), false), b(path("b"), false);
  OutputFile done(path("done"), false);
  done.commit();
  EXPECT_EQ(names().size(), 3u);
  unlink_temporaries();
  EXPECT_EQ(names(), Names{"done"});
}

// Files that killed runs left are removed, and nothing else.

class AbandonedFiles : public TemporaryFolder {
 protected:
  void SetUp() override {
    if (!is_on_local_file_system()) GTEST_SKIP() << folder_ << " is on no local file system";
  }
};

TEST_F(AbandonedFiles, OfTheOutputsAreRemovedAndNothingElse) {
  for (const char* name : {".a.tag.partabcdef", ".a.tag.part012345", ".b.tag.partabcdef", ".a.tag.partabcde",
                           ".a.tag.partabcdefg", ".a.tag.part-abcde", ".a.tag.partABCDEF", "a.tag.partabcdef",
                           ".a.tag.parts", ".a.tag.oldabcdef", ".partabcdef", ".a.partabcdef", "a.tag"})
    file(name, "x");
  mkdir(path(".a.tag.partfolder").c_str(), 0777);
  std::filesystem::create_symlink(path("a.tag"), path(".a.tag.partsymbol"));
  Names expected = names();
  std::erase(expected, ".a.tag.partabcdef");
  std::erase(expected, ".a.tag.part012345");
  EXPECT_EQ(remove_abandoned_files({path("a.tag"), path("c.tag"), path("none/d.tag"), "-", ""}), 2u);
  EXPECT_EQ(names(), expected);
}

TEST_F(AbandonedFiles, AFileInTheMakingIsNoneNorTheOlderOneOfItsName) {
  file("a.tag", "older");
  {
    OutputFile out(path("a.tag"), true);
    out.write("new");
    EXPECT_EQ(remove_abandoned_files({path("a.tag")}), 0u);
    out.publish();
    ASSERT_EQ(names().size(), 2u) << "the older file is kept until keep()";
    EXPECT_EQ(remove_abandoned_files({path("a.tag")}), 0u);
  }
  EXPECT_EQ(names(), Names{"a.tag"});
  EXPECT_EQ(content("a.tag"), "older");
}

TEST_F(AbandonedFiles, OneThatIsBeingRemovedIsNotHeld) {
  const int descriptor = open(file("a", "x").c_str(), O_RDWR), other = open(path("a").c_str(), O_RDWR);
  ASSERT_EQ(flock(other, LOCK_EX), 0);
  EXPECT_FALSE(hold_temporary(descriptor));
  unlink(path("a").c_str());
  close(other);
  EXPECT_FALSE(hold_temporary(descriptor)) << "it has no name any more";
  close(descriptor);
}

TEST_F(AbandonedFiles, OfAProcessThatDiedAreRemoved) {
  const std::string output(200, 'n');
  const pid_t child = fork();
  if (child == 0) {
    OutputFile out(path(output), false);
    out.write("half");
    _exit(0);
  }
  waitpid(child, nullptr, 0);
  ASSERT_EQ(names().size(), 1u);
  EXPECT_EQ(remove_abandoned_files({path(output)}), 1u);
  EXPECT_EQ(names(), Names{});
}

TEST_F(AbandonedFiles, NamesAreCutAsThoseOfTemporaries) {
  const std::string longest(255, 'n');
  file(temporary_name(longest), "x");
  EXPECT_EQ(remove_abandoned_files({path(longest)}), 1u);
  EXPECT_EQ(names(), Names{});
}

// Bytes that wait in a nameless file come back, whatever the order in which they were written.

class SpoolFileTest : public TemporaryFolder {
 protected:
  static std::vector<std::byte> counted(std::size_t size, unsigned step = 1) {
    std::vector<std::byte> bytes(size);
    for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>(i * step >> 3);
    return bytes;
  }
  static std::vector<std::byte> read_all(SpoolFile& spool) {
    std::vector<std::byte> all;
    spool.read_back([&](std::span<std::byte> part) { all.insert(all.end(), part.begin(), part.end()); });
    return all;
  }
};

TEST_F(SpoolFileTest, WhatWasWrittenInOrderComesBackInAnyPieces) {
  // Around the size of its buffer, 1 MiB.
  for (const std::size_t size : {0U, 1U, (1U << 20) - 1, 1U << 20, (1U << 20) + 1, 2'500'000U}) {
    SpoolFile spool = SpoolFile::in(folder_.string(), "x");
    const auto bytes = counted(size);
    for (std::size_t at = 0; at < size; at += 70'001)
      spool.write(std::span(bytes).subspan(at, std::min<std::size_t>(70'001, size - at)));
    EXPECT_EQ(spool.size(), size);
    EXPECT_TRUE(read_all(spool) == bytes) << size;
    EXPECT_TRUE(read_all(spool) == bytes) << "once more";
    if (size < 100) continue;
    std::vector<std::byte> some(99);
    spool.read_at(size - 99, some);
    EXPECT_TRUE(std::equal(some.begin(), some.end(), bytes.end() - 99));
  }
}

TEST_F(SpoolFileTest, WhatWasWrittenAtItsPlaceComesBackInOrderAndNothingOfBeforeIsLeft) {
  SpoolFile spool = SpoolFile::in(folder_.string(), "x");
  for (const unsigned step : {1U, 3U}) {
    // The second time, there is less: the bytes behind it are gone.
    const auto bytes = counted(2'000'000 / step, step);
    const std::size_t half = bytes.size() / 2;
    spool.write_at(half, std::span(bytes).subspan(half));
    spool.write_at(0, std::span(bytes).first(half));
    EXPECT_TRUE(read_all(spool) == bytes) << step;
    spool.clear();
    EXPECT_EQ(spool.size(), 0U);
  }
}

TEST_F(SpoolFileTest, PlacesMayBeWrittenAgainAfterTheyWereRead) {
  SpoolFile spool = SpoolFile::in(folder_.string(), "x");
  std::vector<std::byte> read(1000);
  for (const unsigned step : {1U, 3U, 5U}) {
    const auto bytes = counted(1000, step);
    spool.write_at(5000, bytes);
    spool.read_at(5000, read);
    EXPECT_TRUE(read == bytes) << step;
    spool.write_at(7000, bytes);
    EXPECT_EQ(spool.size(), 8000U);
  }
}

TEST_F(SpoolFileTest, HasNoNameAndLiesBesideItsOutputOrInItsFolder) {
  file("out.nrrd", "older");
  SpoolFile beside = SpoolFile::beside(path("out.nrrd")), in = SpoolFile::in(folder_.string(), "x"),
            elsewhere = SpoolFile::beside("/dev/null");
  beside.write(counted(3'000'000));
  EXPECT_EQ(names(), std::vector<std::string>{"out.nrrd"});
}

TEST_F(SpoolFileTest, AFolderThatIsNotThereIsNamedWithWhomItIsFor) {
  EXPECT_TRUE(has(message_of<WorldError>([&] { SpoolFile::in(path("none"), "scan.nrrd"); }),
                  "scan.nrrd: cannot create a temporary file in " + path("none")));
}

TEST_F(SpoolFileTest, ReadingBehindTheEndIsAnErrorOfTheWorld) {
  SpoolFile spool = SpoolFile::in(folder_.string(), "x");
  spool.write(counted(10));
  std::vector<std::byte> some(11);
  EXPECT_THROW(spool.read_at(0, some), WorldError);
}

// Directories that are written: complete or not at all, and none left behind.

namespace fs = std::filesystem;

bool has_mark(const std::string& folder) { return fs::exists(folder + "/mark"); }

class OutputFolderTest : public TemporaryFolder {
 protected:
  void add(OutputFolder& folder, const std::string& name, std::string_view text) {
    folder.begin(name);
    folder.write(std::as_bytes(std::span(text.data(), text.size())));
    folder.end();
  }
  /// An older directory of this name.
  void make(const std::string& name, const std::string& file_name) {
    fs::create_directories(path(name) + "/b");
    file(name + "/" + file_name, "old");
    file(name + "/b/c", "old");
  }
};

TEST_F(OutputFolderTest, AppearsOnCommitAndNotBefore) {
  OutputFolder out(path("a"), false, {}, has_mark);
  add(out, "mark", "new");
  add(out, "b/c/d", "deep");
  add(out, "b/c/e", "");
  EXPECT_EQ(out.bytes(), 7u);
  ASSERT_EQ(names().size(), 1u);
  EXPECT_TRUE(names()[0].starts_with(".a.part")) << names()[0];
  out.publish();
  out.keep();
  EXPECT_EQ(names(), Names{"a"});
  EXPECT_EQ(content("a/b/c/d"), "deep");
  EXPECT_EQ(fs::status(path("a")).permissions(), fs::status(path("a/b")).permissions());
}

TEST_F(OutputFolderTest, NothingIsLeftWithoutCommit) {
  make("b", "mark");
  for (const bool is_published : {false, true})
    for (const std::string name : {"a", "b"}) {
      {
        OutputFolder out(path(name), true, {}, has_mark);
        add(out, "x/y/z", "new");
        if (is_published) out.publish();
      }
      EXPECT_EQ(names(), Names{"b"}) << name << is_published;
      EXPECT_EQ(content("b/mark"), "old");
      EXPECT_FALSE(fs::exists(path("b/x")));
    }
}

TEST_F(OutputFolderTest, OnlyADirectoryOfItsKindIsReplaced) {
  make("a", "mark");
  make("b", "thesis");
  file("c", "a file");
  fs::create_directory(path("d"));
  fs::create_symlink("a", path("e"));
  EXPECT_THROW(OutputFolder(path("a"), false, {}, has_mark), UsageError);
  EXPECT_THROW(OutputFolder(path("d"), false, {}, has_mark), UsageError);
  for (const char* name : {"b", "c", "e"})
    EXPECT_THROW(OutputFolder(path(name), true, {}, has_mark), UsageError);
  EXPECT_THROW(OutputFolder(path("nowhere/a"), true, {}, has_mark), WorldError);
  for (const std::string name : {"a", "d/"}) {
    OutputFolder out(path(name), true, {}, has_mark);
    add(out, "mark", "new");
    out.publish();
    out.keep();
    EXPECT_EQ(content(name + "/mark"), "new");
    EXPECT_FALSE(fs::exists(path(name + "/b")));
  }
  EXPECT_EQ(names(), (Names{"a", "b", "c", "d", "e"}));
  EXPECT_EQ(content("b/thesis"), "old");
}

TEST_F(OutputFolderTest, AnOtherDirectoryThatAppearsMeanwhileIsKept) {
  {
    OutputFolder out(path("a"), true, {}, has_mark);
    add(out, "mark", "new");
    make("a", "thesis");
    EXPECT_THROW(out.publish(), UsageError);
  }
  EXPECT_EQ(names(), Names{"a"});
  EXPECT_EQ(content("a/thesis"), "old");
}

TEST_F(OutputFolderTest, AnAbandonedOneIsRemovedWithAllThatIsInIt) {
  make(".a.partabcdef", "mark");
  EXPECT_EQ(remove_abandoned_folders({path("a")}), 1u);
  EXPECT_EQ(names(), Names{});
}

}  // namespace
}  // namespace tagrid
