// Files that killed runs left are removed, and nothing else.
#include "io/files/abandoned_files.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include "io/files/output_file.h"
#include "io/files/temporaries.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

class AbandonedFiles : public TemporaryFolder {
 protected:
  void SetUp() override {
    if (!is_on_local_file_system()) GTEST_SKIP() << folder_ << " is on no local file system";
  }
};

using Names = std::vector<std::string>;

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

}  // namespace
}  // namespace tagrid
