// Each call on a file that a command makes fails once, or is the last one before the process is killed or the
// power is cut. No file with its final name is ever incomplete or wrong, no original is gone unless what
// replaces it is there, and the next run completes the work. The files are in memory; see fault_test.cpp and
// convert_fault_test.cpp for a sample with those of the system.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iostream>
#include <optional>
#include <set>
#include <span>

#include "tests/support/memory_files.h"
#include "tools/commands/commands.h"
#include "tools/report/failure.h"

namespace tagrid {
namespace {

using Words = std::vector<std::string>;

/// Runs a command in this process.
Failure run(const Words& words) {
  CLI::App app("", "tagrid");
  std::vector<std::pair<CLI::App*, Action>> commands;
  for (auto* add :
       {add_encode_command, add_convert_command, add_repair_command, add_protect_command, add_verify_command,
        add_archive_repair_command, add_archive_forget_command, add_archive_move_command}) {
    Action action = add(app);
    CLI::App* last = app.get_subcommands({}).back();
    if (!last->get_subcommands({}).empty()) last = last->get_subcommands({}).back();
    commands.emplace_back(last, std::move(action));
  }
  app.parse(Words(words.rbegin(), words.rend()));
  try {
    for (const auto& [command, action] : commands)
      if (command->parsed()) {
        Ranks alone;
        action(alone);
      }
  } catch (const std::exception&) {
    return current_failure();
  }
  return {};
}

/// Of several bricks, or of one.
std::string volume(int seed, bool is_large = true) {
  const int x = is_large ? 10 : 4, y = is_large ? 9 : 4, z = is_large ? 11 : 4;
  std::string nrrd = fmt::format(
      "NRRD0004\ntype: uint8\ndimension: 3\nsizes: {} {} {}\nencoding: raw\nspacings: 1 1 2\n\n", x, y, z);
  for (int i = 0; i < x * y * z; ++i)
    nrrd += static_cast<char>((i % x) * 3 + (i / x % y) * (seed + 1) + (i / x / y > 9 ? 90 : 0));
  return nrrd;
}

/// A command, and what it is for.
struct Case {
  std::string name;
  Words command;
  std::vector<std::pair<std::string, std::string>> files;  ///< that exist before, with their bytes
  Words outputs;                                           ///< of the command
  /// Original files that the command removes, with the outputs that replace them.
  std::vector<std::pair<std::string, std::string>> replaced = {};
  /// Run before; its outputs are files that exist before.
  std::vector<Words> before = {};
  /// A byte of this file is changed before.
  std::string damaged = "";
  Words again = {};  ///< the next run; the command if empty

  friend void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }
};

class EveryCallInMemory : public testing::TestWithParam<Case> {
 protected:
  void SetUp() override {
    testing::internal::CaptureStderr();  // what commands say of their failures
    for (const auto& [path, bytes] : the().files) before_.add(path, bytes);
    before_.add_folder("/memory/out");
    for (const Words& words : the().before) EXPECT_EQ(failure_of(before_, words).code, 0);
    if (const std::string path = the().damaged; !path.empty()) {
      std::string bytes = before_.content(path);
      bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
      before_.add(path, bytes);
    }
    // What was there before has reached the disk.
    for (const std::string& path : before_.all()) before_.add(path, before_.content(path));
    const auto clean = before_.copy();
    clean->spoil({});
    const Failure failure = failure_of(*clean, the().command);
    ASSERT_EQ(failure.code, 0) << failure.message;
    calls_ = clean->calls();
    for (const std::string& path : the().outputs) {
      ASSERT_TRUE(clean->has(path)) << path;
      whole_[path] = clean->content(path);
    }
    for (const auto& [path, output] : the().replaced) ASSERT_FALSE(clean->has(path)) << path;
    left_ = clean->all();
  }

  void TearDown() override { testing::internal::GetCapturedStderr(); }

  static const Case& the() { return GetParam(); }
  static Failure failure_of(MemoryFiles& files, const Words& words) {
    const FilesInstead instead(files);
    return run(words);
  }

  /// True if the command did its work.
  bool is_done(const MemoryFiles& files) const {
    return std::ranges::all_of(whole_,
                               [&](const auto& one) { return files.content(one.first) == one.second; }) &&
           std::ranges::none_of(the().replaced, [&](const auto& one) { return files.has(one.first); });
  }

  void expect_nothing_lost(const MemoryFiles& files) const {
    for (const auto& [path, bytes] : whole_) {
      const bool is_as_before =
          files.has(path) == before_.has(path) && files.content(path) == before_.content(path);
      EXPECT_TRUE(is_as_before || files.content(path) == bytes)
          << path << " is neither the older nor the new file";
    }
    for (const std::string& path : before_.all()) {
      if (whole_.contains(path) || path.ends_with(".jsonl")) continue;
      const auto replaced =
          std::ranges::find(the().replaced, path, [](const auto& one) { return one.first; });
      const bool may_be_gone = replaced != the().replaced.end() && files.has(replaced->second) &&
                               (whole_.contains(replaced->second)
                                    ? files.content(replaced->second) == whole_.at(replaced->second)
                                    : files.content(replaced->second) == before_.content(replaced->second));
      EXPECT_TRUE(files.has(path) ? files.content(path) == before_.content(path) : may_be_gone)
          << path << (files.has(path) ? " was changed" : " is lost");
    }
  }

  void expect_no_temporaries(const MemoryFiles& files) const {
    for (const std::string& path : files.all())
      if (std::ranges::find(left_, path) == left_.end() && !before_.has(path)) {
        // A disk that does not remove it; the next run does.
        // Or one that cannot lock the file of a lock, which may be that of another process.
        const bool could_not = files.spoilt().starts_with("unlink ") ||
                               files.spoilt().starts_with("remove ") || files.spoilt().starts_with("lock ");
        EXPECT_TRUE(could_not || path.ends_with(".jsonl") || is_of_resumed_run(path)) << path << " is left";
      }
  }
  static bool is_of_resumed_run(const std::string& path) { return path.find(".tag.parts/") != path.npos; }

  void expect_next_run_completes(MemoryFiles& files) const {
    if (!is_done(files)) {
      const Failure failure = failure_of(files, the().again.empty() ? the().command : the().again);
      EXPECT_EQ(failure.code, 0) << failure.message;
      // An older file that was set aside stays: it may be the only copy. The removals of a lock, and of the name of
      // its holder, are not synced.
      for (const std::string& path : files.all())
        EXPECT_TRUE(std::ranges::find(left_, path) != left_.end() || before_.has(path) ||
                    path.find(".old") != path.npos || path.ends_with(".lock") || path.ends_with(".holder"))
            << path << " is left";
    }
    EXPECT_TRUE(is_done(files));
  }

  MemoryFiles before_;
  std::map<std::string, std::string> whole_;  ///< outputs of a run without faults
  Words left_;                                ///< the files after it
  std::size_t calls_ = 0;
};

TEST_P(EveryCallInMemory, MayFail) {
  ASSERT_GT(calls_, 10U);
  for (std::size_t at = 1; at <= calls_ && !HasFailure(); ++at) {
    const int error = at % 2 == 0 ? EIO : ENOSPC;
    const auto files = before_.copy();
    files->spoil({.at = at, .error = error});
    const Failure failure = failure_of(*files, the().command);
    SCOPED_TRACE(testing::Message() << "call " << at << " of " << calls_ << ", " << files->spoilt()
                                    << ": error " << error << "; " << failure.code << " " << failure.message);
    if (files->spoilt().empty()) continue;  // with another order of threads, there was one call fewer
    EXPECT_NE(failure.code, exit_bug);
    EXPECT_TRUE(failure.code != 0 || is_done(*files));
    EXPECT_EQ(failure.code == 0, failure.message.empty());
    expect_nothing_lost(*files);
    expect_no_temporaries(*files);
    files->end_process();
    expect_next_run_completes(*files);
  }
}

TEST_P(EveryCallInMemory, MayBeTheLast) {
  for (std::size_t at = 1; at <= calls_ && !HasFailure(); ++at) {
    const auto files = before_.copy();
    files->spoil({.at = at, .is_last = true});
    const Failure failure = failure_of(*files, the().command);
    SCOPED_TRACE(testing::Message() << "call " << at << " of " << calls_ << ", " << files->spoilt());
    for (unsigned kept = 0; kept < 1u << std::min<std::size_t>(files->folders(), 4); ++kept) {
      SCOPED_TRACE(testing::Message() << "power cut, with the last names of the folders " << kept);
      const auto cut = files->copy();
      cut->cut_power(kept);
      expect_nothing_lost(*cut);
      if (kept == 0 && at % 2 == 0) expect_next_run_completes(*cut);
    }
    SCOPED_TRACE("killed");
    files->end_process();
    expect_nothing_lost(*files);
    if (at % 2 == 1) expect_next_run_completes(*files);
  }
}

const Words coding = {"--cube=8", "--brick=1", "--max-error=2", "-T1", "-q"};

Words with(Words words, const Words& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

std::vector<Case> cases() {
  const std::string a = "/memory/in/a.nrrd", b = "/memory/in/b.nrrd", tag = "/memory/out/a.tag";
  const Words encode = with({"encode", a, "-o", tag}, coding);
  const Words convert =
      with({"convert", "--manifest", "/memory/in/list", "--output-dir", "/memory/out/new"}, coding);
  const std::string list = a + "\n" + b + "\n";
  std::vector<Case> all;
  all.push_back({.name = "Encode", .command = encode, .files = {{a, volume(1)}}, .outputs = {tag}});
  all.push_back({.name = "EncodeOver",
                 .command = with(encode, {"-f"}),
                 .files = {{a, volume(1)}, {tag, "an older file"}},
                 .outputs = {tag}});
  all.push_back({.name = "EncodeAndRemove",
                 .command = with(encode, {"--rm"}),
                 .files = {{a, volume(1)}},
                 .outputs = {tag},
                 .replaced = {{a, tag}},
                 .again = with(encode, {"--rm", "-f"})});
  all.push_back(
      {.name = "Resume", .command = with(encode, {"--resume"}), .files = {{a, volume(1)}}, .outputs = {tag}});
  all.push_back({.name = "Convert",
                 .command = with(convert, {"--skip-done"}),
                 .files = {{a, volume(1)}, {b, volume(2, false)}, {"/memory/in/list", list}},
                 .outputs = {"/memory/out/new/a.tag", "/memory/out/new/b.tag"}});
  all.push_back({.name = "RemoveVerified",
                 .command = with(convert, {"--remove-verified"}),
                 .files = {{a, volume(1)}, {b, volume(2, false)}, {"/memory/in/list", list}},
                 .outputs = {},
                 .replaced = {{a, "/memory/out/new/a.tag"}, {b, "/memory/out/new/b.tag"}},
                 .before = {convert}});
  all.push_back({.name = "Protect",
                 .command = {"protect", tag, "--parity", "20%", "-q"},
                 .files = {{a, volume(1)}},
                 .outputs = {tag},
                 .before = {encode}});
  all.push_back({.name = "ProtectBeside",
                 .command = {"protect", tag, "--parity", "20%", "--beside", "-q"},
                 .files = {{a, volume(1)}},
                 .outputs = {tag + ".parity"},
                 .before = {encode}});
  all.push_back({.name = "Repair",
                 .command = {"repair", tag, "-o", "/memory/out/b.tag", "-q"},
                 .files = {{a, volume(1)}},
                 .outputs = {"/memory/out/b.tag"},
                 .before = {encode, {"protect", tag, "--parity", "20%", "-q"}},
                 .damaged = tag});
  // The index of an archive is not in memory, and so a temporary one each time.
  const std::string archive = "/memory/out/new", records = archive + "/results.jsonl";
  all.push_back({.name = "ArchiveRepair",
                 .command = {"archive", "repair", archive, "a.tag", "-q", "-T1"},
                 .files = {{a, volume(1)}, {b, volume(2, false)}, {"/memory/in/list", list}},
                 .outputs = {archive + "/a.tag"},
                 .before = {with(convert, {"--parity=20%"})},
                 .damaged = archive + "/a.tag"});
  all.push_back({.name = "ArchiveForget",
                 .command = {"archive", "forget", archive, "a.tag", "--yes", "-q", "-T1"},
                 .files = {{a, volume(1)}, {b, volume(2, false)}, {"/memory/in/list", list}},
                 .outputs = {records},
                 .replaced = {{archive + "/a.tag", a}},
                 .before = {convert}});
  all.push_back(
      {.name = "ArchiveMove",
       .command = {"archive", "move", archive, "--from", "/memory/in", "--to", "/memory/elsewhere", "-q"},
       .files = {{a, volume(1)}, {b, volume(2, false)}, {"/memory/in/list", list}},
       .outputs = {records},
       .before = {convert}});
  return all;
}

INSTANTIATE_TEST_SUITE_P(, EveryCallInMemory, testing::ValuesIn(cases()),
                         [](const auto& one) { return one.param.name; });

/// Files of which one is changed right before one of the looks at them.
class ChangedMeanwhile : public MemoryFiles {
 public:
  std::size_t at = 0;  ///< the number of the look, from 1; 0: none
  std::size_t looks = 0;
  std::string path;

  int open(const std::string& name, const Opening& how) override {
    look(name);
    const int file = MemoryFiles::open(name, how);
    if (name.starts_with("/memory/in")) inputs_.insert(file);
    return file;
  }
  std::ptrdiff_t read_at(int file, std::uint64_t position, std::span<std::byte> to) override {
    if (inputs_.contains(file)) look("");
    return MemoryFiles::read_at(file, position, to);
  }
  bool status(const std::string& name, bool follows_link, FileStatus& status) override {
    look(name);
    return MemoryFiles::status(name, follows_link, status);
  }

 private:
  void look(const std::string& name) {
    if (!name.empty() && !name.starts_with("/memory/in")) return;
    if (++looks != at) return;
    const int file = MemoryFiles::open(path, {.write = true});
    EXPECT_TRUE(MemoryFiles::write_at(file, 7, std::as_bytes(std::span("?", 1))));
    EXPECT_TRUE(MemoryFiles::close(file));
  }
  std::set<int> inputs_;
};

/// A volume is described once, and its files are opened once. Nevertheless, an output that is there has what its files
/// have in the end, whenever one of them was changed.
TEST(ConvertInMemory, AnInputThatChangesMeanwhileBecomesNoOutput) {
  testing::internal::CaptureStderr();
  std::size_t looks = 1, refused = 0;
  for (std::size_t at = 0; at <= looks; ++at) {
    ChangedMeanwhile files;
    for (int z = 0; z < 3; ++z) {
      std::string slice(20, ' ');
      for (int i = 0; i < 20; ++i) slice[static_cast<std::size_t>(i)] = static_cast<char>(i * z + 40);
      files.add(fmt::format("/memory/in/scan/{}.raw", z), slice);
    }
    files.add("/memory/in/list", "scan\tdims=5,4,3\ttype=uint8\tmax-error=0\n");
    files.add_folder("/memory/out");
    files.path = "/memory/in/scan/2.raw";  // looked at last
    files.at = at;
    const FilesInstead instead(files);
    const Failure failure =
        run({"convert", "--manifest", "/memory/in/list", "--output-dir", "/memory/out", "-q", "-T1"});
    if (at == 0) looks = files.looks;
    files.at = 0;
    ASSERT_EQ(files.has("/memory/out/scan.tag"), failure.code == 0) << at;
    if (failure.code != 0) {
      ++refused;
      continue;
    }
    const Failure differs = run({"verify", "/memory/out/scan.tag", "--against", "/memory/in/scan", "--dims",
                                 "5,4,3", "--type", "uint8", "-q"});
    ASSERT_EQ(differs.code, 0) << "changed before look " << at << " of " << looks << ": " << differs.message;
  }
  testing::internal::GetCapturedStderr();
  EXPECT_GT(refused, looks / 2);
}

/// Files of a system on which an older file that was set aside has its name until it is closed.
class SeenUntilClosed : public MemoryFiles {
 public:
  int open(const std::string& name, const Opening& how) override {
    const int file = MemoryFiles::open(name, how);
    if (file >= 0) open_.insert(file);
    return file;
  }
  bool unlink(const std::string& path) override {
    if (path.find(".old") == path.npos || !is_open(path)) return MemoryFiles::unlink(path);
    unlinked_.insert(path);
    return true;
  }
  bool close(int file) override {
    open_.erase(file);
    const bool is_closed = MemoryFiles::close(file);
    std::erase_if(unlinked_,
                  [&](const std::string& path) { return !is_open(path) && MemoryFiles::unlink(path); });
    return is_closed;
  }
  std::size_t unlinked() const { return unlinked_.size(); }

 private:
  bool is_open(const std::string& path) {
    FileStatus named, ours;
    return MemoryFiles::status(path, false, named) && std::ranges::any_of(open_, [&](int file) {
             return MemoryFiles::status(file, ours) && ours.is_same_file(named);
           });
  }
  std::set<int> open_;
  std::set<std::string> unlinked_;  ///< names that go when their files are closed
};

TEST(ForgetInMemory, DoesNotSearchTheRecordsThatItReplaced) {
  testing::internal::CaptureStderr();
  SeenUntilClosed files;
  files.add("/memory/in/a.nrrd", volume(1));
  files.add("/memory/in/b.nrrd", volume(2, false));
  files.add("/memory/in/list", "/memory/in/a.nrrd\n/memory/in/b.nrrd\n");
  files.add_folder("/memory/out");
  const FilesInstead instead(files);
  EXPECT_EQ(
      run(with({"convert", "--manifest", "/memory/in/list", "--output-dir", "/memory/out/new"}, coding)).code,
      0);
  const Failure failure = run({"archive", "forget", "/memory/out/new", "a.tag", "--yes", "-q", "-T1"});
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_EQ(failure.code, 0) << failure.message << said;
  EXPECT_EQ(files.unlinked(), 0U);
}

}  // namespace
}  // namespace tagrid
