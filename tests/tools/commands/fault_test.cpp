// Disks that fail: every call that the program makes on a file fails once, in turn. See
// tests/faults/fault_injection.cpp.

#include <cerrno>
#include <iostream>

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
    expect_ok(tagrid({"encode", "volume.nhdr", "-o", "volume.tag", "--cube", "8", "--max-error", "9"}));
    // decode --rm refuses a file that keeps source files.
    expect_ok(tagrid(
        {"encode", "volume.nhdr", "-o", "stripped.tag", "--cube", "8", "--max-error", "9", "--strip"}));
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

}  // namespace
}  // namespace tagrid
