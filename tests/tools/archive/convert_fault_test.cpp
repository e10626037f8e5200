// convert with failing calls on files, or killed, before each of its calls in turn: all existing files are
// complete, no original is gone without its output, and the next run completes the work. It is a sample, with
// the files of the system: every_call_test.cpp tries each call in memory.
#include <cerrno>
#include <set>

#include "tests/support/conversions.h"
#include "tests/support/failing_disk.h"

namespace tagrid {
namespace {

struct Fault {
  std::string name, kind;
  bool lasting = false;
  int signal = 0;

  friend void PrintTo(const Fault& fault, std::ostream* out) { *out << fault.name; }
};

class ConvertFault : public Conversions<FailingDisk>, public testing::WithParamInterface<Fault> {
 protected:
  static constexpr const char* originals_[] = {"a.nhdr", "a.raw", "b.nrrd"};

  void make_volumes() {
    volume("a.nhdr", 1);
    volume("b.nrrd", 2);
    file("list.tsv", "a.nhdr\nb.nrrd\toutput=x/y/b\n");
    for (const std::string name : originals_) before_[name] = content(name);
  }
  void restore_originals() const {
    for (const auto& [name, bytes] : before_)
      if (!exists(name)) file(name, bytes);
  }

  /// Runs `convert` with `more` once for each call that it makes on a file, and makes that call fail; then
  /// runs it once more without failures. `prepare` makes the files that the run finds.
  template <class Prepare, class Expect>
  void spoil_each_call(const Arguments& more, Prepare prepare, Expect expect_after_the_next_run) {
    const Case spoiled{"", with(command_, more)};
    prepare();
    Ending good;
    const std::vector<Call> calls = calls_of(spoiled, good);
    ASSERT_EQ(good.code, 0) << good.err;
    for (const std::string name : {"a.tag", "x/y/b.tag"}) whole_[name] = content("out/" + name);
    std::map<std::string, std::size_t> seen;
    std::size_t spoilt = 0;
    const std::size_t step = stride == 1 ? 1 : 3 * stride;
    for (std::size_t i = 0; i < calls.size() && !HasFailure(); ++i) {
      if (++seen[calls[i].name + " " + calls[i].path] > 2 || i % step != 0) continue;
      SCOPED_TRACE("call " + std::to_string(i + 1) + ", " + calls[i].name + " " + calls[i].path);
      prepare();
      const Ending ending = run(spoiled, std::to_string(i + 1), GetParam().kind, GetParam().lasting);
      ++spoilt;
      EXPECT_EQ(ending.signal, GetParam().signal) << ending.err;
      if (ending.signal == 0) {
        EXPECT_TRUE(ending.code == 0 || ending.code == broken_input || ending.code == world) << ending.code;
        EXPECT_EQ(ending.code == 0, ending.err.empty()) << ending.err;
      }
      expect_whole_files();
      const Ending next = convert(more);
      EXPECT_EQ(next.code, 0) << next.err;
      expect_whole_files();
      records();  // every line is whole
      expect_after_the_next_run();
    }
    std::cout << spoilt << " of " << calls.size() << " calls were spoilt\n";
    EXPECT_GT(spoilt, 0U);
  }

  void expect_whole_files() const {
    if (!exists("out")) return;
    std::set<std::string> there;
    for (const std::string& name : files_in_out()) {
      there.insert(name);
      if (name.ends_with(".tag")) {
        EXPECT_TRUE(content("out/" + name) == whole_.at(name)) << name << " is not whole";
      } else if (name != "results.jsonl") {
        // A disk that fails may not remove the last two either; these are no files of anybody.
        const bool is_temporary = GetParam().signal == SIGKILL && name.find(".part") != name.npos;
        EXPECT_TRUE(is_temporary || name.ends_with(".tag.lock") || name.ends_with(".holder")) << name;
      }
    }
    for (const auto& [name, bytes] : before_) {
      EXPECT_TRUE(!exists(name) || content(name) == bytes) << name;
      EXPECT_TRUE(exists(name) || there.contains(name[0] == 'a' ? "a.tag" : "x/y/b.tag"))
          << name << " is gone";
    }
    std::istringstream lines(content("out/results.jsonl"));
    for (std::string line; std::getline(lines, line);) {
      const Json record = Json::parse(line, nullptr, false);
      // Half of the last line at most.
      EXPECT_TRUE(!record.is_discarded() || lines.eof()) << line;
      if (record.is_discarded()) continue;
      EXPECT_NE(record["code"], 70) << line;
      const bool is_there = there.contains(record["output"].get<std::string>());
      EXPECT_TRUE(is_there || record["status"] != "ok") << line;
    }
  }

  /// Folders are not counted: a directory for an output that was not written may be empty.
  std::vector<std::string> files_in_out() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(path("out")))
      if (!entry.is_directory()) names.push_back(entry.path().lexically_relative(path("out")).string());
    std::sort(names.begin(), names.end());
    return names;
  }

  Files before_;
  mutable Files whole_;
};

TEST_P(ConvertFault, WhileEncodingLosesNothing) {
  make_volumes();
  spoil_each_call(
      {"--skip-done"}, [&] { std::filesystem::remove_all(path("out")); },
      [&] {
        std::set<std::string> good;
        for (const Json& record : records())
          if (record["status"] == "ok") good.insert(record["output"].get<std::string>());
        EXPECT_EQ(good, (std::set<std::string>{"a.tag", "x/y/b.tag"}));
        for (const std::string name : originals_) EXPECT_TRUE(exists(name)) << name;
        std::vector<std::string> there = files_in_out();
        if (!is_on_local_file_system())
          std::erase_if(there, [](const std::string& name) {
            return name.find(".part") != name.npos || name.ends_with(".lock");
          });
        EXPECT_EQ(there, (std::vector<std::string>{"a.tag", "results.jsonl", "x/y/b.tag"}));
      });
}

TEST_P(ConvertFault, WhileOriginalsAreRemovedLosesNothing) {
  make_volumes();
  expect_ok(convert());
  const std::string encoded = content("out/results.jsonl");
  spoil_each_call(
      {"--remove-verified"},
      [&] {
        restore_originals();
        file("out/results.jsonl", encoded);
      },
      [&] {
        for (const std::string name : {"a.nhdr", "b.nrrd"}) EXPECT_FALSE(exists(name)) << name;
        EXPECT_TRUE(exists("out/a.tag") && exists("out/x/y/b.tag"));
      });
}

/// A run that stops before it touches a file, and goes on after other runs.
class ConvertStopped : public Conversions<FailingDisk> {
 protected:
  /// `prepare` makes the files that the run finds. It stops at the call that comes `later` than the one before
  /// the first call on a file that is called `name`.
  template <class Prepare>
  Ending convert_around(Prepare prepare, const std::string& option, const std::string& name,
                        std::size_t later, const std::string& meanwhile) const {
    prepare();
    Ending good;
    const std::vector<Call> calls = calls_of({"", with(command_, {option})}, good);
    std::size_t at = 0;
    while (calls.at(at).path.find(name) == std::string::npos) ++at;
    prepare();
    return script("LD_PRELOAD=" TAGRID_FAULT_INJECTION
                  " ASAN_OPTIONS=verify_asan_link_order=0 TAGRID_FAULT_FOLDER=$PWD TAGRID_FAULT_KIND=SIGSTOP "
                  "TAGRID_FAULT_AT=" +
                  std::to_string(at + later) + " $TAGRID convert --manifest list.tsv --output-dir out " +
                  option +
                  " -v & first=$!\n"
                  "until grep -q '^State:.T' /proc/$first/status; do sleep 0.01; done\n" +
                  meanwhile + "; kill -CONT $first; wait $first");
  }
  /// Runs that share a file of records wait for each other.
  const std::string other_run_ = "$TAGRID convert --output-dir out --shard 0/1 -q --manifest ";
};

/// Before or after the run has created the temporary file of out/a.tag.
class ConvertAtOnce : public ConvertStopped, public testing::WithParamInterface<bool> {
 protected:
  Ending convert_around(const std::string& meanwhile) const {
    return ConvertStopped::convert_around([&] { std::filesystem::remove_all(path("out")); }, "--skip-done",
                                          ".a.tag.part", GetParam() ? 2 : 0, meanwhile);
  }
};

TEST_P(ConvertAtOnce, TheLaterOfTwoRunsTakesWhatTheOtherMade) {
  volumes(2);
  const Ending later = convert_around(other_run_ + "list.tsv");
  EXPECT_EQ(later.code, 0) << later.err;
  EXPECT_TRUE(
      has(later.err, "out/a.tag: another run created it in the meantime; it was compared with its volume\n"));
  EXPECT_EQ(outputs(), (std::vector<std::string>{"a.tag", "b.tag"}));
  EXPECT_EQ(statuses(2, "out/results-0-of-1.jsonl"), "a ok, b ok");
  EXPECT_EQ(statuses(), "a ok, b skipped");  // it reads what the other one recorded
  for (const Json& record : records())
    EXPECT_EQ(record["output_xxh3"], checksum(content("out/" + record["output"].get<std::string>())))
        << record;
  expect_ok(convert({"--remove-verified"}));
  EXPECT_FALSE(exists("a.nrrd"));
}

TEST_P(ConvertAtOnce, AnotherFileOfTheNameIsNoResult) {
  volumes(1);
  for (const std::string& meanwhile :
       {other_run_ + "list.tsv --max-error 9", std::string("echo else > out/a.tag")}) {
    SCOPED_TRACE(meanwhile);
    expect_failed(convert_around(meanwhile), "out/a.tag: already exists, and is not known to be made from");
    EXPECT_EQ(outputs(), (std::vector<std::string>{"a.tag"}));
    EXPECT_EQ(last()["status"], "failed");
    EXPECT_TRUE(exists("a.nrrd"));
  }
  EXPECT_EQ(content("out/a.tag"), "else\n");
}

INSTANTIATE_TEST_SUITE_P(WithTheTemporaryFile, ConvertAtOnce, testing::Bool());

// Without -f, only the output that was found missing or damaged is replaced.
TEST_F(ConvertStopped, WhatAnotherRunEncodesInTheMeantimeIsComparedAndNotReplaced) {
  volumes(1);
  for (const std::string spoil : {"rm out/a.tag", "echo half a file > out/a.tag"}) {
    SCOPED_TRACE(spoil);
    const auto around = [&](const std::string& meanwhile) {
      const auto spoilt = [&] {
        expect_ok(script("rm -rf out; $TAGRID convert --manifest list.tsv --output-dir out -q; " + spoil));
      };
      return convert_around(spoilt, "--skip-done", ".a.tag.part", 0, other_run_ + meanwhile);
    };
    expect_failed(around("list.tsv -f --max-error 9"),
                  "out/a.tag: already exists, and is not known to be made from");
    EXPECT_EQ(records("out/results-0-of-1.jsonl").back()["output_xxh3"], checksum(content("out/a.tag")));
    const Ending same = around("list.tsv --skip-done");
    EXPECT_EQ(same.code, 0) << same.err;
    EXPECT_TRUE(has(same.err, "another run created it in the meantime; it was compared with its volume"));
    EXPECT_EQ(last()["compared"], true);
  }
  expect_ok(convert({"--remove-verified"}));
}

// The failure may have a reason that is one of the disk, or of the volume.
TEST_F(ConvertStopped, AFailureThatIsRecordedDuringTheVerificationKeepsTheOriginal) {
  volumes(1);
  file("broken.nrrd", content("a.nrrd").substr(0, 4000));
  file("broken.tsv", "broken.nrrd\toutput=a\n");
  const std::string whole = content("a.nrrd");
  const auto encoded = [&] {
    file("a.nrrd", whole);
    expect_ok(script("rm -rf out; $TAGRID convert --manifest list.tsv --output-dir out -q"));
  };
  const Ending ending =
      convert_around(encoded, "--remove-verified", ".a.tag.lock", 0, other_run_ + "broken.tsv -f || true");
  expect_failed(ending, "a.nrrd: its last encoding failed: ");
  EXPECT_EQ(records("out/results-0-of-1.jsonl").back()["status"], "failed");
  EXPECT_EQ(last()["status"], "kept");
  EXPECT_TRUE(exists("a.nrrd"));
}

INSTANTIATE_TEST_SUITE_P(By, ConvertFault,
                         testing::Values(Fault{"Kill", "SIGKILL", false, SIGKILL},
                                         Fault{"Term", "SIGTERM", false, SIGTERM},
                                         Fault{"ErrorOfTheDisk", std::to_string(EIO)},
                                         Fault{"FullDisk", std::to_string(ENOSPC), true}),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace tagrid
