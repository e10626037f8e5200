// Programs that read and write formats: where they are found, and what they claim.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/stat.h>

#include <array>
#include <chrono>
#include <memory>
#include <thread>

#include "io/errors/errors.h"
#include "io/programs/find.h"
#include "io/programs/format_program.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

// Programs that do as they should, and programs that do not.

using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;

class FormatProgramTest : public TemporaryFolder {
 protected:
  /// Starts a script of a shell.
  FormatProgram& start(const std::string& script, const FormatProgram::Limits& limits = {}) {
    program_ = file("reader", "#!/bin/sh\n" + script + "\n");
    chmod(program_.c_str(), 0700);
    process_ = std::make_unique<FormatProgram>(program_, limits);
    return *process_;
  }
  /// The message of the WorldError that `work` throws; it begins with the path of the program.
  template <class Work>
  std::string failure(Work work) const {
    const std::string message = message_of<WorldError>(work);
    EXPECT_THAT(message, testing::StartsWith(program_ + ": "));
    return message;
  }
  static bool runs(pid_t process) {
    std::ifstream file(fmt::format("/proc/{}/stat", process));
    std::string number, name, state;
    return (file >> number >> name >> state) && state != "Z";
  }
  void end() { process_.reset(); }

  std::string program_;

 private:
  std::unique_ptr<FormatProgram> process_;
};

TEST_F(FormatProgramTest, AnswersLinesAndBytes) {
  FormatProgram& program = start("while read -r line; do echo \"heard $line\"; printf abcdef; done");
  for (const char* text : {"one", "two words"}) {
    program.say(text);
    EXPECT_EQ(program.hear(), std::string("heard ") + text);
    std::array<std::byte, 6> bytes;
    program.read(bytes.data(), 2);
    program.read(bytes.data() + 2, 4);
    EXPECT_EQ(std::string(reinterpret_cast<const char*>(bytes.data()), 6), "abcdef");
  }
  program.finish();
}

TEST_F(FormatProgramTest, LongLinesAndManyBytesCome) {
  FormatProgram& program = start("read -r line; echo \"$line\"; head -c 3000000 /dev/zero");
  const std::string line(500'000, 'x');
  program.say(line);
  EXPECT_EQ(program.hear(), line);
  std::vector<std::byte> bytes(3'000'000, std::byte{1});
  program.read(bytes.data(), bytes.size());
  EXPECT_EQ(bytes, std::vector<std::byte>(bytes.size()));
  program.finish();
}

TEST_F(FormatProgramTest, OneThatCannotBeStartedIsAnError) {
  program_ = path("absent");
  EXPECT_THAT(failure([&] { FormatProgram(program_, FormatProgram::Limits{}); }),
              HasSubstr("cannot start it: No such file"));
  file("absent", "#!/bin/sh\n");
  EXPECT_THAT(failure([&] { FormatProgram(program_, FormatProgram::Limits{}); }),
              HasSubstr("Permission denied"));
}

/// Starts nothing.
struct FailingProcesses : Processes {
  StartedChild::Failure failure = {};
  int error = 0;

  StartedChild start(const std::string&, std::vector<std::string>, std::uint64_t) override {
    return {failure, error};
  }
  StartedChild ask_for_twin(const Child&, std::string_view) override { return {failure, error}; }
  bool take_twin(int, std::uint64_t) override { return false; }
  int limit_memory(int, std::uint64_t) override { return 0; }
  ChildEnding ending(int, std::chrono::milliseconds) override { return {}; }
  void kill(int) override {}
};

TEST_F(FormatProgramTest, EachStepOfTheStartMayFail) {
  using Failure = StartedChild::Failure;
  program_ = "/a/program";
  FailingProcesses failing;
  const ProcessesInstead instead(failing);
  const auto failure_of = [&](Failure at, int error) {
    failing.failure = at;
    failing.error = error;
    return failure([&] { FormatProgram(program_, FormatProgram::Limits{}); });
  };
  EXPECT_THAT(failure_of(Failure::pipe, EMFILE),
              HasSubstr("/a/program: cannot make a pipe to it: Too many open"));
  EXPECT_THAT(failure_of(Failure::process, EAGAIN), HasSubstr("raise the limit on processes (ulimit -u)"));
  EXPECT_THAT(failure_of(Failure::process, ENOMEM),
              HasSubstr("cannot start a process for it: Cannot allocate"));
  EXPECT_THAT(failure_of(Failure::program, ETXTBSY), HasSubstr("cannot start it: Text file busy"));
}

TEST_F(FormatProgramTest, OneThatDiesIsQuoted) {
  EXPECT_THAT(failure([&] { start("echo 'the file is odd' >&2; exit 3").hear(); }),
              HasSubstr("exited with code 3 before it answered; stderr: the file is odd"));
  EXPECT_THAT(failure([&] { start("printf 'half a line'; kill -SEGV $$").hear(); }),
              HasSubstr("ended by signal 11 (Segmentation fault)"));
  EXPECT_THAT(failure([&] {
                std::array<std::byte, 6> bytes;
                start("printf abc").read(bytes.data(), bytes.size());
              }),
              HasSubstr("exited with code 0 before it answered"));
  // A line that nobody reads is an error, and no signal.
  EXPECT_THAT(failure([&] {
                FormatProgram& program = start("exit 1");
                for (;;) program.say(std::string(10'000, 'x'));
              }),
              HasSubstr("exited with code 1"));
}

TEST_F(FormatProgramTest, AReaderThatCrashesHasABrokenInput) {
  const auto dies_by = [&](const char* signal) {
    FormatProgram& program = start(fmt::format("kill -{} $$", signal));
    program.reads("scan.h5");
    program.hear();
  };
  EXPECT_THROW(dies_by("SEGV"), BrokenInput);
  EXPECT_THROW(dies_by("FPE"), BrokenInput);
  // The system lacks memory, or somebody ended it.
  EXPECT_THROW(dies_by("KILL"), WorldError);
}

TEST_F(FormatProgramTest, OneThatIsSilentIsEnded) {
  const auto start_time = std::chrono::steady_clock::now();
  EXPECT_THAT(failure([&] { start("sleep 1000", {.silence = 300ms}).hear(); }),
              HasSubstr("did not answer for"));
  EXPECT_THAT(failure([&] { start("sleep 1000", {.silence = 300ms}).say(std::string(10'000'000, 'x')); }),
              HasSubstr("did not answer for"));
  end();
  EXPECT_LT(std::chrono::steady_clock::now() - start_time, 60s);
}

TEST_F(FormatProgramTest, OneThatSpeaksAgainAndAgainIsNotSilent) {
  FormatProgram& program =
      start("for i in 1 2 3 4 5 6 7 8; do sleep 0.3; printf .; done; echo end", {.silence = 2000ms});
  EXPECT_EQ(program.hear(), "........end");
}

TEST_F(FormatProgramTest, AFloodIsEnded) {
  EXPECT_THAT(failure([&] { start("yes >&2", {.silence = 2000ms}).hear(); }),
              AllOf(HasSubstr("did not answer"), HasSubstr("y\ny")));
  EXPECT_THAT(failure([&] { start("cat /dev/zero", {.line = 1'000'000}).hear(); }),
              HasSubstr("gave an answer of more than 1000000 bytes"));
}

TEST_F(FormatProgramTest, MuchOnStandardErrorIsTakenAndItsEndKept) {
  FormatProgram& program =
      start("head -c 300000 /dev/zero | tr '\\0' x >&2; echo ' the end' >&2; echo answer; exit 7");
  EXPECT_EQ(program.hear(), "answer");
  const std::string message = failure([&] { program.finish(); });
  EXPECT_THAT(message, AllOf(HasSubstr("exited with code 7"), testing::EndsWith("x the end")));
  EXPECT_LT(message.size(), 3000U);
}

TEST_F(FormatProgramTest, OneThatSaysTooMuchIsAnError) {
  EXPECT_THAT(failure([&] {
                FormatProgram& program = start("echo answer; echo more");
                program.hear();
                program.finish();
              }),
              HasSubstr("sent unexpected output"));
}

TEST_F(FormatProgramTest, ItsProcessesEndWithIt) {
  FormatProgram& program = start("sleep 1000 & echo $!; wait");
  const pid_t grandchild = std::stoi(program.hear());
  EXPECT_TRUE(runs(grandchild));
  end();
  for (int i = 0; i < 6000 && runs(grandchild); ++i) std::this_thread::sleep_for(10ms);
  EXPECT_FALSE(runs(grandchild));
}

TEST_F(FormatProgramTest, ItGetsNoFilesOfOursAndPlainMessages) {
  const std::ifstream ours("/dev/null");
  FormatProgram& program = start("echo $(ls /proc/self/fd); echo $LC_ALL");
  EXPECT_EQ(program.hear(), "0 1 2 3") << "3 is the directory that ls reads";
  EXPECT_EQ(program.hear(), "C");
}

TEST_F(FormatProgramTest, AWaitCanBeStopped) {
  std::atomic<bool> stop = false;
  FormatProgram& program = start("sleep 1000");
  program.stop_when(stop);
  std::thread later([&] {
    std::this_thread::sleep_for(50ms);
    stop = true;
  });
  EXPECT_THAT(failure([&] { program.hear(); }), HasSubstr("no longer needed"));
  later.join();
}

using testing::Contains;

class FindReader : public TemporaryFolder {
 protected:
  ~FindReader() override { unsetenv("TAGRID_READER_PATH"); }
  static void look_in(const std::string& folders) { setenv("TAGRID_READER_PATH", folders.c_str(), 1); }
  std::string program(const std::string& name, mode_t mode = 0755) {
    std::filesystem::create_directories(std::filesystem::path(path(name)).parent_path());
    const std::string made = file(name, "#!/bin/sh\n");
    chmod(made.c_str(), mode);
    return made;
  }
};

TEST_F(FindReader, TheFirstFolderThatHasItCounts) {
  const std::string first = program("a/tagrid-read-one"), other = program("b/tagrid-read-two");
  program("b/tagrid-read-one");
  look_in(path("nowhere") + "::" + path("a") + ":" + path("b"));
  EXPECT_EQ(find_reader("one"), first);
  EXPECT_EQ(find_reader("two"), other);
  EXPECT_EQ(find_reader("three"), std::nullopt);
  EXPECT_THAT(all_readers(), Contains(FoundProgram{"one", first}));
  EXPECT_THAT(all_readers(), Contains(FoundProgram{"two", other}));
}

TEST_F(FindReader, OnlyAbsoluteFoldersCount) {
  program("a/tagrid-read-one");
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(path(""));
  for (const char* folders : {"a", "./a", "", ":", "a:b", "../a"}) {
    look_in(folders);
    EXPECT_EQ(find_reader("one"), std::nullopt) << folders;
    for (const std::string& folder : program_folders()) EXPECT_TRUE(folder.starts_with('/')) << folder;
  }
  std::filesystem::current_path(before);
}

TEST_F(FindReader, NamesDoNotLeaveTheirFolder) {
  program("one");
  program("a/tagrid-read-x/y");
  look_in(path("a"));
  for (const char* name : {"", "../one", "x/y", "x/../../one", "X", "x y", "x\n", "-\xff"})
    EXPECT_EQ(find_reader(name), std::nullopt) << name;
}

TEST_F(FindReader, WhatIsNoProgramIsNoReader) {
  program("a/tagrid-read-data", 0644);
  program("a/tagrid-read-Upper");
  program("a/read-other");
  std::filesystem::create_directories(path("a/tagrid-read-folder"));
  look_in(path("a"));
  // Root may read everything, but executes only what somebody may execute.
  for (const char* name : {"data", "folder", "upper", "other"})
    EXPECT_EQ(find_reader(name), std::nullopt) << name;
  for (const FoundProgram& reader : all_readers())
    EXPECT_FALSE(reader.path.starts_with(path("a"))) << reader.path;
}

TEST_F(FindReader, AProgramThatAnybodyCanChangeIsAnError) {
  program("a/tagrid-read-one", 0777);
  look_in(path("a"));
  EXPECT_THROW(find_reader("one"), WorldError);
}

}  // namespace
}  // namespace tagrid
