// The files of the system, and those in memory, do the same; and what survives a power cut.
#include "io/system/files.h"

#include <array>

#include "tests/support/memory_files.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

std::span<const std::byte> bytes_of(std::string_view text) { return std::as_bytes(std::span(text)); }

/// In a directory of the disk, and in one in memory.
class Files : public TemporaryFolder, public testing::WithParamInterface<bool> {
 protected:
  Files() : files_(GetParam() ? static_cast<FileSystem&>(memory_) : files_of_system()) {
    memory_.add_folder("/memory/folder");
  }
  std::string at(const std::string& name) const {
    return (GetParam() ? "/memory/folder" : folder_.string()) + "/" + name;
  }
  void make(const std::string& name, std::string_view text) {
    const int file = files_.open(at(name), {.write = true, .creates = true, .empties = true});
    ASSERT_GE(file, 0);
    EXPECT_TRUE(files_.write_at(file, 0, bytes_of(text)));
    EXPECT_TRUE(files_.close(file));
  }
  std::string text(const std::string& name) {
    const int file = files_.open(at(name), {.read = true});
    if (file < 0) return "none";
    std::array<std::byte, 100> bytes;
    const std::ptrdiff_t count = files_.read(file, bytes);
    EXPECT_EQ(files_.read(file, bytes), 0) << "there is more";
    files_.close(file);
    return {reinterpret_cast<const char*>(bytes.data()), static_cast<std::size_t>(count)};
  }
  /// 0, or the errno of a call.
  static int error_of(bool is_good) { return is_good ? 0 : errno; }
  std::vector<std::string> listed() {
    std::vector<FolderEntry> entries;
    EXPECT_TRUE(files_.list(at("."), entries));
    std::vector<std::string> listed_names;
    for (const FolderEntry& entry : entries) listed_names.push_back(entry.name);
    std::sort(listed_names.begin(), listed_names.end());
    return listed_names;
  }

  MemoryFiles memory_;
  FileSystem& files_;
};

TEST_P(Files, NewNamesReplaceNothing) {
  make("a", "1");
  make("b", "2");
  EXPECT_EQ(error_of(files_.rename_to_new(at("a"), at("b"))), EEXIST);
  EXPECT_EQ(error_of(files_.link(at("a"), at("b"))), EEXIST);
  EXPECT_EQ(files_.open(at("b"), {.write = true, .creates = true, .is_new = true}), -1);
  EXPECT_EQ(errno, EEXIST);
  EXPECT_EQ(text("b"), "2");
  EXPECT_TRUE(files_.rename(at("a"), at("b")));
  EXPECT_EQ(text("b"), "1");
  EXPECT_EQ(error_of(files_.rename(at("a"), at("b"))), ENOENT);
  EXPECT_EQ(listed(), (std::vector<std::string>{"b"}));
}

TEST_P(Files, SecondNamesLeadToOneFile) {
  make("a", "1");
  EXPECT_TRUE(files_.link(at("a"), at("b")));
  FileStatus a, b;
  EXPECT_TRUE(files_.status(at("a"), false, a) && files_.status(at("b"), false, b));
  EXPECT_TRUE(a.is_same_file(b) && a.is_file());
  EXPECT_EQ(a.links, 2U);
  EXPECT_TRUE(files_.rename(at("a"), at("b"))) << "does nothing";
  EXPECT_EQ(listed(), (std::vector<std::string>{"a", "b"}));
  EXPECT_TRUE(files_.unlink(at("a")));
  EXPECT_EQ(text("b"), "1");
}

TEST_P(Files, OpenFilesLiveWithoutTheirName) {
  make("a", "1");
  const int file = files_.open(at("a"), {.read = true, .write = true});
  EXPECT_TRUE(files_.unlink(at("a")));
  FileStatus status;
  EXPECT_TRUE(files_.status(file, status));
  EXPECT_EQ(status.links, 0U);
  EXPECT_TRUE(files_.write_at(file, 3, bytes_of("4")));
  std::array<std::byte, 10> bytes;
  EXPECT_EQ(files_.read_at(file, 0, bytes), 4);
  EXPECT_EQ(files_.read_at(file, 4, bytes), 0);
  EXPECT_TRUE(files_.resize(file, 2));
  EXPECT_EQ(files_.read_at(file, 0, bytes), 2);
  files_.close(file);
  EXPECT_EQ(listed(), std::vector<std::string>());
}

TEST_P(Files, LocksBelongToAnOpening) {
  make("a", "1");
  const int one = files_.open(at("a"), {.read = true}), other = files_.open(at("a"), {.read = true});
  EXPECT_TRUE(files_.lock(one, false));
  EXPECT_TRUE(files_.lock(one, false));
  EXPECT_EQ(error_of(files_.lock(other, false)), EWOULDBLOCK);
  files_.close(one);
  EXPECT_TRUE(files_.lock(other, false));
  files_.close(other);
}

TEST_P(Files, FoldersHaveNamesOfTheirOwn) {
  EXPECT_TRUE(files_.make_folder(at("x")));
  EXPECT_EQ(error_of(files_.make_folder(at("x"))), EEXIST);
  EXPECT_EQ(error_of(files_.make_folder(at("y/z"))), ENOENT);
  make("x/a", "1");
  EXPECT_EQ(error_of(files_.unlink(at("x"))), EISDIR);
  EXPECT_EQ(error_of(files_.remove_folder(at("x"))), ENOTEMPTY);
  EXPECT_TRUE(files_.make_folder(at("y")));
  EXPECT_TRUE(files_.exchange(at("x"), at("y")));
  EXPECT_EQ(text("y/a"), "1");
  EXPECT_EQ(error_of(files_.exchange(at("x"), at("no"))), ENOENT);
  std::string resolved;
  EXPECT_TRUE(files_.resolve(at("x/../y/./a"), resolved));
  EXPECT_TRUE(resolved.ends_with("/y/a"));
  EXPECT_EQ(error_of(files_.resolve(at("no"), resolved)), ENOENT);
  const FilesInstead instead(files_);
  EXPECT_TRUE(remove_with_files(at("y")));
  EXPECT_EQ(listed(), (std::vector<std::string>{"x"}));
  EXPECT_EQ(sync_folder(at("x")), 0);
  EXPECT_EQ(sync_folder(at("no")), ENOENT);
  EXPECT_FALSE(status_of(at("y")));
  EXPECT_TRUE(status_of(at("x"))->is_folder());
}

INSTANTIATE_TEST_SUITE_P(, Files, testing::Bool(),
                         [](const auto& which) { return which.param ? "InMemory" : "OfTheSystem"; });

/// An older file "a", and what replaces it, step by step.
std::vector<std::string> after_power_cut(int steps, unsigned kept_names) {
  MemoryFiles files;
  files.add("/memory/a", "old");
  const int file = files.open("/memory/b", {.write = true, .creates = true});
  if (steps > 0) files.write_at(file, 0, bytes_of("new"));
  if (steps > 1) files.sync(file);
  if (steps > 2) files.rename("/memory/b", "/memory/a");
  if (steps > 3) files.sync(files.open_folder("/memory"));
  files.cut_power(kept_names);
  std::vector<std::string> left;
  for (const std::string& path : files.all()) left.push_back(path.substr(8) + " " + files.content(path));
  return left;
}

TEST(PowerCut, LeavesWhatWasSynced) {
  using Left = std::vector<std::string>;
  EXPECT_EQ(after_power_cut(1, 0), Left{"a old"});
  EXPECT_EQ(after_power_cut(1, 1), (Left{"a old", "b "}));
  EXPECT_EQ(after_power_cut(2, 0), Left{"a old"});
  EXPECT_EQ(after_power_cut(2, 1), (Left{"a old", "b new"}));
  EXPECT_EQ(after_power_cut(3, 0), Left{"a old"});
  EXPECT_EQ(after_power_cut(3, 1), Left{"a new"});
  EXPECT_EQ(after_power_cut(4, 0), Left{"a new"});
}

TEST(CallFault, FailsOneCallOrAllFromThereOn) {
  for (const bool is_last : {false, true}) {
    MemoryFiles files;
    files.add("/memory/a", "1");
    files.spoil({.at = 2, .error = ENOSPC, .is_last = is_last});
    const int file = files.open("/memory/a", {.write = true});
    EXPECT_FALSE(files.write_at(file, 1, bytes_of("23")));
    EXPECT_EQ(errno, ENOSPC);
    EXPECT_EQ(files.sync(file), !is_last);
    EXPECT_EQ(files.calls(), 3U);
    EXPECT_EQ(files.spoilt(), "write /memory/a");
    EXPECT_EQ(files.content("/memory/a"), is_last ? "1" : "12");
  }
}

}  // namespace
}  // namespace tagrid
