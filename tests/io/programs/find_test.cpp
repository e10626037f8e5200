#include "io/programs/find.h"

#include <gmock/gmock.h>
#include <stdlib.h>
#include <sys/stat.h>

#include "io/errors/errors.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

using testing::Contains;
using testing::Not;

class FindReader : public TemporaryFolder {
 protected:
  ~FindReader() override { unsetenv("TAGRID_READER_PATH"); }
  static void look_in(const std::string& folders) { setenv("TAGRID_READER_PATH", folders.c_str(), 1); }
  std::string program(const std::string& name, mode_t mode = 0755) {
    std::filesystem::create_directories(std::filesystem::path(path(name)).parent_path());
    const std::string made = file(name, "#!/bin/sh\n");
    chmod(made.c_str(), mode);
    return made;
  }
};

TEST_F(FindReader, TheFirstFolderThatHasItCounts) {
  const std::string first = program("a/tagrid-read-one"), other = program("b/tagrid-read-two");
  program("b/tagrid-read-one");
  look_in(path("nowhere") + "::" + path("a") + ":" + path("b"));
  EXPECT_EQ(find_reader("one"), first);
  EXPECT_EQ(find_reader("two"), other);
  EXPECT_EQ(find_reader("three"), std::nullopt);
  EXPECT_THAT(all_readers(), Contains(FoundProgram{"one", first}));
  EXPECT_THAT(all_readers(), Contains(FoundProgram{"two", other}));
}

TEST_F(FindReader, OnlyAbsoluteFoldersCount) {
  program("a/tagrid-read-one");
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(path(""));
  for (const char* folders : {"a", "./a", "", ":", "a:b", "../a"}) {
    look_in(folders);
    EXPECT_EQ(find_reader("one"), std::nullopt) << folders;
    for (const std::string& folder : program_folders()) EXPECT_TRUE(folder.starts_with('/')) << folder;
  }
  std::filesystem::current_path(before);
}

TEST_F(FindReader, NamesDoNotLeaveTheirFolder) {
  program("one");
  program("a/tagrid-read-x/y");
  look_in(path("a"));
  for (const char* name : {"", "../one", "x/y", "x/../../one", "X", "x y", "x\n", "-\xff"})
    EXPECT_EQ(find_reader(name), std::nullopt) << name;
}

TEST_F(FindReader, WhatIsNoProgramIsNoReader) {
  program("a/tagrid-read-data", 0644);
  program("a/tagrid-read-Upper");
  program("a/read-other");
  std::filesystem::create_directories(path("a/tagrid-read-folder"));
  look_in(path("a"));
  // Root may read everything, but executes only what somebody may execute.
  for (const char* name : {"data", "folder", "upper", "other"})
    EXPECT_EQ(find_reader(name), std::nullopt) << name;
  for (const FoundProgram& reader : all_readers())
    EXPECT_FALSE(reader.path.starts_with(path("a"))) << reader.path;
}

TEST_F(FindReader, AProgramThatAnybodyCanChangeIsAnError) {
  program("a/tagrid-read-one", 0777);
  look_in(path("a"));
  EXPECT_THROW(find_reader("one"), WorldError);
}

}  // namespace
}  // namespace tagrid
