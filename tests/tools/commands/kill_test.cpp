// Runs ended from outside by SIGKILL, SIGTERM and SIGINT: before every call on a file in turn, and at random
// moments. A name never belongs to an incomplete file. TAGRID_KILLS sets how many random moments are tried
// for each signal and command, and TAGRID_SEED selects them.
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <random>

#include "io/metadata/metadata.h"
#include "tests/support/failing_disk.h"

namespace tagrid {
namespace {

constexpr std::pair<int, const char*> signals[] = {
    {SIGKILL, "SIGKILL"}, {SIGTERM, "SIGTERM"}, {SIGINT, "SIGINT"}};

class Kill : public FailingDisk, public testing::WithParamInterface<Case> {
 protected:
  void make_files(const std::string& dims) {
    phantom("volume.nhdr", {"--dims", dims});
    expect_ok(tagrid({"encode", "volume.nhdr", "-o", "volume.tag", "--cube", "8", "--max-error", "9"}));
    // decode --rm refuses a file that keeps source files.
    expect_ok(tagrid(
        {"encode", "volume.nhdr", "-o", "stripped.tag", "--cube", "8", "--max-error", "9", "--strip"}));
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
    expect_ok(tagrid({"encode", "volume.nhdr", "-o", "volume.tag", "--cube", "8"}));
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
        expect_ok(tagrid({"restore", "volume.tag", "-fo", "new/deep/er"}));
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
  expect_ok(tagrid({"restore", "volume.tag", "-o", "new/deep/er"}));
  EXPECT_EQ(content("new/deep/er/.restored.partabcdef/0"), "a part");
  close(descriptor);
  file("new/deep/er/.restored.partabcdef/1.old", "an older file");
  expect_ok(tagrid({"restore", "volume.tag", "-fo", "new/deep/er"}));
  if (!is_on_local_file_system()) return;
  EXPECT_FALSE(std::filesystem::exists(held + "/0"));
  EXPECT_EQ(content("new/deep/er/.restored.partabcdef/1.old"), "an older file");
  std::filesystem::remove(held + "/1.old");
  expect_ok(tagrid({"restore", "volume.tag", "-fo", "new/deep/er"}));
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
