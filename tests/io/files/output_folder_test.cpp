// Directories that are written: complete or not at all, and none left behind.
#include "io/files/output_folder.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <string_view>

#include "io/errors/errors.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;
using Names = std::vector<std::string>;

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
