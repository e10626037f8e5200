#include "io/files/output_file.h"

#include <sys/stat.h>

#include <cstring>

#include "io/errors/errors.h"
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

TEST_F(OutputFileTest, FoldersAndMissingFoldersAreRefused) {
  EXPECT_THROW(OutputFile(folder_.string(), true), UsageError);
  const std::string message = message_of<WorldError>([&] { OutputFile(path("gone/a.tag"), false); });
  EXPECT_NE(message.find("gone/a.tag"), message.npos) << message;
}

TEST_F(OutputFileTest, ADanglingLinkIsNotOverwritten) {
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

TEST_F(OutputFileTest, DevicesAreWrittenStraight) {
  OutputFile out("/dev/null", false);
  out.write("x");
  out.commit();
  EXPECT_TRUE(std::filesystem::exists("/dev/null"));
}

TEST_F(OutputFileTest, AFullDiskIsAnErrorOfTheWorld) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  OutputFile out("/dev/full", false);
  const std::string message = message_of<WorldError>([&] { out.write("x"); });
  EXPECT_NE(message.find("/dev/full"), message.npos) << message;
  EXPECT_NE(message.find("space"), message.npos) << message;
}

TEST_F(OutputFileTest, ASignalHandlerCanRemoveAllTemporaries) {
  OutputFile a(path("a"), false), b(path("b"), false);
  OutputFile done(path("done"), false);
  done.commit();
  EXPECT_EQ(names().size(), 3u);
  unlink_temporaries();
  EXPECT_EQ(names(), Names{"done"});
}

}  // namespace
}  // namespace tagrid
