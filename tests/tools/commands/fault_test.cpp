// Disks that fail: every call that the program makes on a file fails once, in turn. See
// tests/faults/fault_injection.cpp.
#include <sys/file.h>
#include <cerrno>
#include <random>

#include "io/metadata/metadata.h"
#include "tests/support/failing_disk.h"

namespace tagrid {
namespace {

class EveryCall : public FailingDisk, public testing::WithParamInterface<Case> {
 protected:
  EveryCall() {
    const Arguments small = {"--dims", "23,19,21"};
    phantom("volume.nhdr", small);
    phantom("other.raw", small);
    works("encode volume.nhdr -o volume.tag --cube 8 --max-error 9");
    // decode --rm refuses a file that keeps source files.
    works("encode volume.nhdr -o stripped.tag --cube 8 --max-error 9 --strip");
    expect_ok(
        script("gzip -nc volume.raw > packed.raw.gz; sed 's/raw$/gzip/; s/volume.gzip/packed.raw.gz/' "
               "volume.nhdr > packed.nhdr"));
    for (const std::string& name : GetParam().older) file(name, name.ends_with(".json") ? "{}" : "older");
    before_ = files();
    calls_ = calls_of(GetParam(), good_);
    EXPECT_EQ(good_.code, 0) << good_.err;
    EXPECT_FALSE(calls_.empty());
    after_ = files();
    restore(before_);
    choose();
  }

  /// Chooses the calls: all, but only some of long rows of the same call, such as a read for each slice.
  void choose() {
    std::map<std::string, std::size_t> seen;
    for (std::size_t i = 0; i < calls_.size(); ++i) {
      const std::size_t number = ++seen[calls_[i].name + " " + calls_[i].path];
      if ((number <= 12 || number % 16 == 0) && i % stride == 0) chosen_.push_back(i);
    }
    std::cout << GetParam().name << ": " << chosen_.size() << " of " << calls_.size() << " calls\n";
  }

  void expect_good(const Ending& ending) const {
    EXPECT_EQ(ending.code, 0) << ending.err;
    EXPECT_EQ(ending.out, good_.out);
    Files now = files();
    // The lock of an output could not be removed; it is empty, and the next run removes it.
    std::erase_if(now, [](const auto& f) { return f.first.starts_with('.') && f.first.ends_with(".lock"); });
    expect_same(now, after_);
  }
  void expect_nothing_happened(const Ending& ending, const std::string& name) const {
    expect_error(ending, world, name);
    expect_same(files(), before_);
  }
  static void expect_same(const Files& now, const Files& expected) {
    EXPECT_TRUE(now == expected);
    if (now == expected) return;
    for (const auto& [name, bytes] : now) {
      if (!expected.contains(name))
        ADD_FAILURE() << name << " is there";
      else if (expected.at(name) != bytes)
        ADD_FAILURE() << name << " is not as it was";
    }
    for (const auto& [name, bytes] : expected)
      if (!now.contains(name)) ADD_FAILURE() << name << " is gone";
  }

  /// If a file cannot be removed, or if it, its copy or their lock cannot be looked at once more before that, these are
  /// the only failures that leave something: that file. The result is complete.
  void expect_all_but_the_removal(const Ending& ending, const std::string& name) const {
    expect_error(ending, world, name);
    Files now = files();
    for (const auto& [file_name, bytes] : after_) {
      EXPECT_TRUE(bytes == "JSON" || now[file_name] == bytes) << file_name;
    }
    EXPECT_LE(now.size(), after_.size() + 2);
  }

  bool is_only_the_removal_left() const {
    const bool removes =
        std::ranges::any_of(before_, [&](const auto& f) { return !after_.contains(f.first); });
    return removes && files() != before_;
  }

  void fail_each(int error, bool lasting) {
    for (const std::size_t i : chosen_) {
      const Call& call = calls_[i];
      if (lasting && !call.needs_space()) continue;
      SCOPED_TRACE(call.name + " " + call.path + ": " + strerror(error));
      const Ending ending = run(GetParam(), std::to_string(i + 1), std::to_string(error), lasting);
      if (ending.code == 0 && may_be_ignored(call)) {
        expect_good(ending);
      } else if (call.name == "unlink" || is_only_the_removal_left()) {
        expect_all_but_the_removal(ending, expected_name(GetParam(), call));
      } else {
        expect_nothing_happened(ending, expected_name(GetParam(), call));
      }
      restore(before_);
    }
  }

  Files before_, after_;
  Ending good_;
  std::vector<Call> calls_;
  std::vector<std::size_t> chosen_;
};

TEST_P(EveryCall, ThatFailsOnceEndsTheRunAndLeavesEverythingAsItWas) { fail_each(EIO, false); }

TEST_P(EveryCall, OnADiskThatIsFullFromThenOnLeavesEverythingAsItWas) { fail_each(ENOSPC, true); }

TEST_P(EveryCall, ThatIsShortOrInterruptedMakesNoDifference) {
  for (const char* kind : {"short", "EINTR"}) {
    SCOPED_TRACE(kind);
    const bool is_short = kind == std::string("short");
    const auto try_at = [&](std::size_t number) {
      expect_good(run(GetParam(), std::to_string(number), kind));
      restore(before_);
    };
    try_at(0);
    for (const std::size_t i : chosen_) {
      SCOPED_TRACE(calls_[i].name + " " + calls_[i].path);
      if (is_short ? calls_[i].transfers() : calls_[i].can_be_interrupted()) try_at(i + 1);
    }
  }
}

// With several threads it is not known which call fails, but the result is one of the two anyway.
TEST_P(EveryCall, OnSeveralThreadsIsAllOrNothing) {
  Case c = GetParam();
  for (std::string& argument : c.arguments)
    if (argument == "-T1") argument = "-T3";
  for (std::size_t i = 1; i <= calls_.size(); i += 5 * stride) {
    SCOPED_TRACE(i);
    const Ending ending = run(c, std::to_string(i), std::to_string(EIO));
    if (ending.code == 0)
      expect_good(ending);
    else if (is_only_the_removal_left())
      expect_all_but_the_removal(ending, "");
    else if (ending.err.find("cannot remove") == std::string::npos)
      expect_nothing_happened(ending, "");
    restore(before_);
  }
}

const std::vector<std::string> small_grid = {"--cube", "8", "--brick", "1", "--max-error", "9", "-T1"};

Case with_grid(Case c) {
  c.arguments.insert(c.arguments.end(), small_grid.begin(), small_grid.end());
  return c;
}

INSTANTIATE_TEST_SUITE_P(
    Command, EveryCall,
    testing::Values(with_grid({"Encode", words("encode volume.nhdr -o new.tag --json new.json")}),
                    with_grid({"EncodeOver",
                               words("encode volume.nhdr -fo new.tag --json new.json"),
                               {"new.tag", "new.json"}}),
                    with_grid({"EncodeAndRemove", words("encode volume.nhdr -o new.tag --rm")}),
                    with_grid({"EncodeHeaderless",
                               words("encode other.raw --dims 23,19,21 --type int16 -o new.tag")}),
                    with_grid({"EncodePacked", words("encode packed.nhdr -o new.tag")}),
                    with_grid({"EncodeRangeOfData", words("encode volume.nhdr --range=auto -o new.tag")}),
                    with_grid({"EncodeToPipe", words("encode volume.nhdr -o -"), {}, true}),
                    Case{"Decode", words("decode volume.tag -o new.nrrd --json new.json -T1")},
                    Case{"DecodeDetached", words("decode volume.tag -o new.nhdr --json=new.json -T1")},
                    Case{"DecodeOver",
                         words("decode volume.tag -fo new.nhdr --json=new.json -T1"),
                         {"new.nhdr", "new.raw", "new.json"}},
                    Case{"DecodeSamples", words("decode volume.tag -o new.raw -T1")},
                    Case{"DecodeAndRemove", words("decode stripped.tag -o new.nrrd --rm -T1")},
                    Case{"DecodeToPipe", words("decode - -T1"), {}, true},
                    Case{"Mesh", words("mesh volume.tag -o new.vtu --json new.json -T1")},
                    Case{"MeshToPipe", words("mesh volume.tag -o - -T1"), {}, true},
                    Case{"Preview", words("preview volume.tag -o new.png --json new.json -T1")},
                    Case{"PreviewToPipe", words("preview volume.tag -o - -T1"), {}, true},
                    Case{"Verify", words("verify volume.tag --against volume.nhdr --json=new.json -T1")},
                    Case{"Restore", words("restore volume.tag -fo . --json=new.json -T1")},
                    Case{"Info", words("info volume.tag")},
                    Case{"Phantom", words("phantom --dims 23,19,21 -o new.nhdr --json=new.json -T1")}),
    [](const auto& test) { return test.param.name; });

// Runs ended from outside by SIGKILL, SIGTERM and SIGINT: before every call on a file in turn, and at random
// moments. A name never belongs to an incomplete file. TAGRID_KILLS sets how many random moments are tried
// for each signal and command, and TAGRID_SEED selects them.

constexpr std::pair<int, const char*> signals[] = {
    {SIGKILL, "SIGKILL"}, {SIGTERM, "SIGTERM"}, {SIGINT, "SIGINT"}};

class Kill : public FailingDisk, public testing::WithParamInterface<Case> {
 protected:
  void make_files(const std::string& dims) {
    phantom("volume.nhdr", {"--dims", dims});
    works("encode volume.nhdr -o volume.tag --cube 8 --max-error 9");
    // decode --rm refuses a file that keeps source files.
    works("encode volume.nhdr -o stripped.tag --cube 8 --max-error 9 --strip");
    for (const std::string& name : GetParam().older) file(name, name.ends_with(".json") ? "{}" : "older");
    before_ = files();
  }

  static bool is_temporary(const std::string& name) {
    return (name.starts_with(".new.") && name.find(".part") != name.npos) || is_older(name) || is_lock(name);
  }
  static bool is_older(const std::string& name) {
    return name.starts_with(".new.") && name.find(".old") != name.npos;
  }

  /// Of an output, or of the .tag file that decode --rm removes. It is empty, and remains only after SIGKILL.
  static bool is_lock(const std::string& name) { return name.starts_with('.') && name.ends_with(".lock"); }

  /// Expects that every file is as before or as a run makes it, and that no input is gone before every output
  /// is complete. Returns the temporary files.
  std::vector<std::string> expect_whole_files() const {
    const Files now = files();
    std::vector<std::string> temporaries;
    for (const auto& file : now) {
      const std::string& name = file.first;
      const auto holds = [&](const Files& expected) {
        return expected.contains(name) && expected.at(name) == file.second;
      };
      if (is_temporary(name))
        temporaries.push_back(name);
      else
        EXPECT_TRUE(holds(before_) || holds(after_)) << name << " is neither as it was nor whole";
    }
    bool input_is_gone = false;
    for (const auto& [name, bytes] : before_) {
      EXPECT_TRUE(now.contains(name) || !after_.contains(name)) << name << " is gone";
      input_is_gone = input_is_gone || !now.contains(name);
    }
    for (const auto& [name, bytes] : after_)
      EXPECT_TRUE(!input_is_gone || now.contains(name)) << "the input is gone, and there is no " << name;
    return temporaries;
  }

  void expect_what_a_signal_leaves(int signal) const {
    const std::vector<std::string> temporaries = expect_whole_files();
    // The new file and the older one of its name, for every output.
    const std::size_t outputs = static_cast<std::size_t>(std::count_if(
        after_.begin(), after_.end(), [](const auto& f) { return f.first.starts_with("new."); }));
    EXPECT_LE(temporaries.size(), signal == SIGKILL ? 2 * outputs + 1 : 0)
        << (temporaries.empty() ? "" : temporaries[0]);
  }

  /// Runs the command once more, with the leftovers in place, and then tidies up.
  void expect_that_the_next_run_succeeds() const {
    Arguments command = with({program_under_test()}, GetParam().arguments);
    command.push_back("-f");
    const bool input_is_there = std::filesystem::exists(path(GetParam().arguments[1]));
    if (input_is_there) {
      const Ending ending = Process(command, folder_.string()).finish();
      EXPECT_EQ(ending.code, 0) << ending.err;
    }
    Files now = files();
    // Older files that were set aside stay for the user.
    const bool tidies_up = input_is_there && is_on_local_file_system();
    std::erase_if(now, [&](const auto& f) { return tidies_up ? is_older(f.first) : is_temporary(f.first); });
    // If an input has two files, the second may be left if --rm was ended between them.
    if (!input_is_there)
      std::erase_if(now,
                    [&](const auto& f) { return !after_.contains(f.first) && before_.contains(f.first); });
    EXPECT_TRUE(now == after_) << "the next run is not whole, or leaves what it found";
    restore(before_);
  }

  Files before_, after_;
};

TEST_P(Kill, BeforeAnyCallOnAFileLeavesWholeFiles) {
  make_files("23,19,21");
  Ending good;
  const std::vector<Call> calls = calls_of(GetParam(), good);
  ASSERT_EQ(good.code, 0) << good.err;
  after_ = files();
  restore(before_);
  std::map<std::string, std::size_t> seen;
  std::size_t kills = 0, left = 0;
  for (std::size_t i = 0; i < calls.size() && !HasFailure(); ++i) {
    // Only some of long rows of the same call.
    const std::size_t number = ++seen[calls[i].name + " " + calls[i].path];
    if ((number > 4 && number % 16 != 0) || i % stride != 0) continue;
    for (const auto& [signal, name] : signals) {
      SCOPED_TRACE(std::string(name) + " before call " + std::to_string(i + 1) + ", " + calls[i].name + " " +
                   calls[i].path);
      const Ending ending = run(GetParam(), std::to_string(i + 1), name);
      EXPECT_EQ(ending.signal, signal) << ending.err;
      EXPECT_EQ(ending.err, "");
      expect_what_a_signal_leaves(signal);
      ++kills;
      left += std::ranges::any_of(names(), is_temporary);
      if (signal == SIGKILL)
        expect_that_the_next_run_succeeds();
      else
        restore(before_);
    }
  }
  std::cout << kills << " signals before " << calls.size() << " calls, " << left << " left a temporary\n";
  EXPECT_GT(kills, 0U);
}

TEST_P(Kill, AtAnyMomentLeavesWholeFiles) {
  make_files("64,60,56");
  const Arguments command = with({program_under_test()}, GetParam().arguments);
  const Ending good = Process(command, folder_.string()).finish();
  ASSERT_EQ(good.code, 0) << good.err;
  after_ = files();
  restore(before_);
  const unsigned long count = number_in_environment("TAGRID_KILLS", stride > 1 ? 1 : 4),
                      seed = number_in_environment("TAGRID_SEED", std::random_device()());
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> moment(0, good.seconds);
  std::size_t kills = 0, in_time = 0, left = 0;
  for (unsigned long i = 0; i < count && !HasFailure(); ++i)
    for (const auto& [signal, name] : signals) {
      const double seconds = moment(random);
      SCOPED_TRACE(std::string(name) + " after " + std::to_string(seconds) +
                   " s, TAGRID_SEED=" + std::to_string(seed));
      Process process(command, folder_.string());
      usleep(static_cast<useconds_t>(seconds * 1e6));
      process.send(signal);
      const Ending ending = process.finish();
      EXPECT_TRUE(ending.signal == signal || ending.code == 0) << ending.code << " " << ending.err;
      ++kills;
      in_time += ending.signal == signal;
      left += std::ranges::any_of(names(), is_temporary);
      expect_what_a_signal_leaves(signal);
      expect_that_the_next_run_succeeds();
    }
  std::cout << kills << " signals, " << in_time << " before the end, " << left << " left a temporary\n";
}

/// `restore` into a directory whose parents are missing, too.
class RestoredFolder : public FailingDisk {
 protected:
  const Case restore_ = {"Restore", {"restore", "volume.tag", "-o", "new/deep/er", "-T1"}};
  std::vector<Call> calls_;

  void SetUp() override {
    phantom("volume.nhdr", {"--dims", "23,19,21"});
    works("encode volume.nhdr -o volume.tag --cube 8");
    Ending good;
    calls_ = calls_of(restore_, good);
    ASSERT_EQ(good.code, 0) << good.err;
    expect_all_files();
    std::filesystem::remove_all(path("new"));
  }

  std::vector<std::string> hidden() const {
    std::vector<std::string> found;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_))
      if (entry.path().filename().string().starts_with('.')) found.push_back(entry.path());
    return found;
  }
  void expect_all_files() const {
    for (const char* name : {"volume.nhdr", "volume.raw"})
      EXPECT_EQ(content(std::string("new/deep/er/") + name), content(name)) << name;
  }
  /// Expects all files, or no directory.
  void expect_all_or_nothing() const {
    if (std::filesystem::exists(path("new"))) expect_all_files();
    EXPECT_TRUE(hidden().empty()) << hidden().front();
  }
};

TEST_F(RestoredFolder, GoesWithTheRunThatASignalEnds) {
  for (std::size_t i = 0; i < calls_.size() && !HasFailure(); ++i)
    for (const auto& [signal, name] : signals) {
      SCOPED_TRACE(std::string(name) + " before " + calls_[i].name + " " + calls_[i].path);
      EXPECT_EQ(run(restore_, std::to_string(i + 1), name).signal, signal);
      if (signal == SIGKILL) {
        // The next run removes what this one could not.
        works("restore volume.tag -fo new/deep/er");
        expect_all_files();
        if (is_on_local_file_system()) {
          EXPECT_TRUE(hidden().empty()) << hidden().front();
        }
      } else {
        expect_all_or_nothing();
      }
      std::filesystem::remove_all(path("new"));
    }
}

TEST_F(RestoredFolder, GoesWithTheRunThatFails) {
  for (std::size_t i = 0; i < calls_.size() && !HasFailure(); ++i) {
    SCOPED_TRACE(calls_[i].name + " " + calls_[i].path);
    const Ending ending = run(restore_, std::to_string(i + 1), std::to_string(EIO));
    if (calls_[i].name == "rmdir" || ending.code == 0) {
      expect_all_files();
    } else {
      expect_error(ending, world, "");
      EXPECT_FALSE(std::filesystem::exists(path("new")));
    }
    std::filesystem::remove_all(path("new"));
  }
}

TEST_F(RestoredFolder, IsLeftAloneWhileAnotherRunHoldsIt) {
  std::filesystem::create_directories(path("new/deep/er/.restored.partabcdef"));
  file("new/deep/er/.restored.partabcdef/0", "a part");
  const std::string held = path("new/deep/er/.restored.partabcdef");
  const int descriptor = open(held.c_str(), O_RDONLY | O_DIRECTORY);
  ASSERT_EQ(flock(descriptor, LOCK_EX | LOCK_NB), 0);
  works("restore volume.tag -o new/deep/er");
  EXPECT_EQ(content("new/deep/er/.restored.partabcdef/0"), "a part");
  close(descriptor);
  file("new/deep/er/.restored.partabcdef/1.old", "an older file");
  works("restore volume.tag -fo new/deep/er");
  if (!is_on_local_file_system()) return;
  EXPECT_FALSE(std::filesystem::exists(held + "/0"));
  EXPECT_EQ(content("new/deep/er/.restored.partabcdef/1.old"), "an older file");
  std::filesystem::remove(held + "/1.old");
  works("restore volume.tag -fo new/deep/er");
  EXPECT_FALSE(std::filesystem::exists(held));
}

INSTANTIATE_TEST_SUITE_P(
    Of, Kill,
    testing::Values(Case{"Encode", words("encode volume.nhdr -o new.tag --cube=8 --json=new.json")},
                    Case{"EncodeOver",
                         words("encode volume.nhdr -fo new.tag --cube=8 --json=new.json"),
                         {"new.tag", "new.json"}},
                    Case{"EncodeAndRemove", words("encode volume.nhdr -o new.tag --cube=8 --rm")},
                    Case{"Decode", words("decode volume.tag -o new.nhdr --json=new.json")},
                    Case{"DecodeOver", words("decode volume.tag -fo new.nhdr"), {"new.nhdr", "new.raw"}},
                    Case{"DecodeAndRemove", words("decode stripped.tag -o new.nrrd --rm")},
                    Case{"Mesh", words("mesh volume.tag -o new.vtu")},
                    Case{"Preview", words("preview volume.tag -o new.png")}),
    [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace tagrid
