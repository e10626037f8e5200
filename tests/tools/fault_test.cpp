// Disks that fail: every call that the program makes on a file fails once, in turn. See
// tests/faults/fault_injection.cpp.

#include <cerrno>
#include <iostream>
#include <map>

#include "tools/command_line.h"

namespace tagrid {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr std::size_t stride = 11;  // every call would take too long
#else
constexpr std::size_t stride = 1;
#endif

struct Call {
  std::string name, path;

  bool is_one_of(const std::vector<std::string>& calls) const {
    return std::find(calls.begin(), calls.end(), name) != calls.end();
  }
  bool transfers() const { return is_one_of({"read", "pread", "write", "pwrite"}); }
  bool needs_space() const {
    return is_one_of({"open-to-write", "mkostemp", "write", "pwrite", "fsync", "link"});
  }
  bool can_be_interrupted() const {
    return transfers() || is_one_of({"open", "open-to-write", "fsync", "close"});
  }
};

struct Case {
  std::string name;
  std::vector<std::string> arguments;
  std::vector<std::string> older = {};  ///< files that are there before, to be overwritten
  bool streams = false;                 ///< standard input and output fail as well

  friend void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }
};

class FailingDisk : public CommandLine {
 protected:
  using Files = std::map<std::string, std::string>;

  mutable int runs_ = 0;

  ~FailingDisk() override {
    std::filesystem::remove(log());
    std::cout << runs_ << " runs of the program\n";
  }
  std::string log() const { return folder_.string() + ".calls"; }

  /// Every file with its bytes. Reports tell times: they are whole, that is all.
  Files files() const {
    Files result;
    for (const std::string& name : names())
      result[name] =
          name.ends_with(".json") && nlohmann::json::accept(content(name)) ? "JSON" : content(name);
    return result;
  }
  void restore(const Files& files) const {
    for (const std::string& name : names())
      if (!files.contains(name)) std::filesystem::remove(path(name));
    for (const auto& [name, bytes] : files)
      if (bytes == "JSON")
        file(name, "{}");
      else if (content(name) != bytes)
        file(name, bytes);
  }

  Ending run(const Case& c, const std::string& at, const std::string& kind, bool lasting = false) const {
    Arguments command = {"env",
                         "LD_PRELOAD=" TAGRID_FAULT_INJECTION,
                         "ASAN_OPTIONS=verify_asan_link_order=0",
                         "TMPDIR=" + folder_.string(),
                         "TAGRID_FAULT_FOLDER=" + folder_.string(),
                         "TAGRID_FAULT_LOG=" + (at == "-1" ? log() : ""),
                         "TAGRID_FAULT_AT=" + at,
                         "TAGRID_FAULT_KIND=" + kind,
                         std::string("TAGRID_FAULT_LASTING=") + (lasting ? "1" : ""),
                         std::string("TAGRID_FAULT_STREAMS=") + (c.streams ? "1" : ""),
                         TAGRID_PROGRAM};
    ++runs_;
    const std::string input = c.arguments[1] == "-" ? content("volume.tag") : "";
    return Process(with(command, c.arguments), folder_.string()).finish(input);
  }

  std::vector<Call> calls_of(const Case& c, Ending& ending) const {
    std::filesystem::remove(log());
    ending = run(c, "-1", "0");
    std::vector<Call> calls;
    std::ifstream lines(log());
    for (std::string line; std::getline(lines, line);)
      calls.push_back({line.substr(0, line.find(' ')), line.substr(line.find(' ') + 1)});
    return calls;
  }

  /// The name that a message about a call has to say.
  std::string expected_name(const Case& c, const Call& call) const {
    if (call.path.find("pipe:") == 0) return "standard ";
    const std::string name = std::filesystem::path(call.path).filename().string();
    const bool nameless = name.starts_with("#") || name == "." || call.path == folder_.string() ||
                          name.starts_with(".tagrid.part");
    if (nameless) return c.streams ? "standard output" : "new.";
    const std::size_t part = name.find(".part");
    return part == name.npos ? name : name.substr(1, part - 1);
  }

  /// Failures that may be passed over, because the result is right without: what was read is closed, times
  /// and owners are kept where that is possible, and older files are set aside where that is possible.
  bool may_be_ignored(const Call& call) const {
    if (call.is_one_of({"close", "futimens", "fchmod", "fchown", "link"})) return true;
    // Nameless files: there is another way. Pipes: it is no file for certain.
    return (call.name == "open-to-write" &&
            std::filesystem::path(call.path).filename() == folder_.filename()) ||
           (call.name == "open-to-write" && call.path.ends_with("/.")) ||
           (call.name == "fstat" && call.path.find("pipe:") == 0);
  }
};

class EveryCall : public FailingDisk, public testing::WithParamInterface<Case> {
 protected:
  EveryCall() {
    const Arguments small = {"--dims", "23,19,21"};
    phantom("volume.nhdr", small);
    phantom("other.raw", small);
    expect_ok(tagrid({"encode", "volume.nhdr", "-o", "volume.tag", "--cube", "8", "--max-error", "9"}));
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

  /// Every call, but of long rows of one and the same, such as a read for each slice, only some.
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
    expect_same(files(), after_);
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

  /// A file that cannot be removed is the one failure that leaves something: itself. The result is whole
  /// then.
  void expect_all_but_the_removal(const Ending& ending, const std::string& name) const {
    expect_error(ending, world, name);
    Files now = files();
    for (const auto& [file_name, bytes] : after_) {
      EXPECT_TRUE(bytes == "JSON" || now[file_name] == bytes) << file_name;
    }
    EXPECT_LE(now.size(), after_.size() + 2);
  }

  void fail_each(int error, bool lasting) {
    for (const std::size_t i : chosen_) {
      const Call& call = calls_[i];
      if (lasting && !call.needs_space()) continue;
      SCOPED_TRACE(call.name + " " + call.path + ": " + strerror(error));
      const Ending ending = run(GetParam(), std::to_string(i + 1), std::to_string(error), lasting);
      if (ending.code == 0 && may_be_ignored(call)) {
        expect_good(ending);
      } else if (call.name == "unlink") {
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

// Then it is not known which call it is, but the result is one of two all the same.
TEST_P(EveryCall, OnSeveralThreadsIsAllOrNothing) {
  Case c = GetParam();
  for (std::string& argument : c.arguments)
    if (argument == "-T1") argument = "-T3";
  for (std::size_t i = 1; i <= calls_.size(); i += 5 * stride) {
    SCOPED_TRACE(i);
    const Ending ending = run(c, std::to_string(i), std::to_string(EIO));
    if (ending.code == 0)
      expect_good(ending);
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
    testing::Values(
        with_grid({"Encode", {"encode", "volume.nhdr", "-o", "new.tag", "--json", "new.json"}}),
        with_grid({"EncodeOver",
                   {"encode", "volume.nhdr", "-fo", "new.tag", "--json", "new.json"},
                   {"new.tag", "new.json"}}),
        with_grid({"EncodeAndRemove", {"encode", "volume.nhdr", "-o", "new.tag", "--rm"}}),
        with_grid({"EncodeHeaderless",
                   {"encode", "other.raw", "--dims", "23,19,21", "--type", "int16", "-o", "new.tag"}}),
        with_grid({"EncodePacked", {"encode", "packed.nhdr", "-o", "new.tag"}}),
        with_grid({"EncodeRangeOfData", {"encode", "volume.nhdr", "--range=auto", "-o", "new.tag"}}),
        with_grid({"EncodeToPipe", {"encode", "volume.nhdr", "-o", "-"}, {}, true}),
        Case{"Decode", {"decode", "volume.tag", "-o", "new.nrrd", "--json", "new.json", "-T1"}},
        Case{"DecodeDetached", {"decode", "volume.tag", "-o", "new.nhdr", "--json=new.json", "-T1"}},
        Case{"DecodeOver",
             {"decode", "volume.tag", "-fo", "new.nhdr", "--json=new.json", "-T1"},
             {"new.nhdr", "new.raw", "new.json"}},
        Case{"DecodeSamples", {"decode", "volume.tag", "-o", "new.raw", "-T1"}},
        Case{"DecodeAndRemove", {"decode", "volume.tag", "-o", "new.nrrd", "--rm", "-T1"}},
        Case{"DecodeToPipe", {"decode", "-", "-T1"}, {}, true},
        Case{"Mesh", {"mesh", "volume.tag", "-o", "new.vtu", "--json", "new.json", "-T1"}},
        Case{"MeshToPipe", {"mesh", "volume.tag", "-o", "-", "-T1"}, {}, true},
        Case{"Verify", {"verify", "volume.tag", "--against", "volume.nhdr", "--json=new.json", "-T1"}},
        Case{"Info", {"info", "volume.tag"}},
        Case{"Phantom", {"phantom", "--dims", "23,19,21", "-o", "new.nhdr", "--json=new.json", "-T1"}}),
    [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace tagrid
