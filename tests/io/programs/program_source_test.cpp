// Volumes that a program reads slice by slice, or whose places it tells.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/stat.h>

#include <array>
#include <atomic>
#include <fstream>
#include <random>

#include "io/errors/errors.h"
#include "io/metadata/text.h"
#include "io/programs/volumes.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

using testing::HasSubstr;

class ProgramSourceTest : public TemporaryFolder {
 protected:
  /// A script of a shell that reads as its lines say.
  std::string reader(const std::string& script) const {
    const std::string program =
        file("reader", "#!/bin/sh\necho '{\"tagrid-reader\": 1}'\nread -r line\n" + script);
    chmod(program.c_str(), 0700);
    return program;
  }
  std::unique_ptr<VolumeSource> open(const std::string& text) {
    return open_with_reader(TAGRID_RAMP_READER, file("a.ramp", text), {});
  }
  static void expect_slices(VolumeSource& source, std::int64_t count) {
    const auto first = static_cast<std::uint32_t>(source.next_sample());
    std::vector<std::uint32_t> samples(static_cast<std::size_t>(count * source.slice_samples()));
    source.read_slices(reinterpret_cast<std::byte*>(samples.data()), count);
    for (std::size_t i = 0; i < samples.size(); ++i) ASSERT_EQ(samples[i], first + i);
  }
};

TEST_F(ProgramSourceTest, SlicesComeInAnyOrder) {
  for (const char* order : {"any", "next"}) {
    const auto source = open(std::string("7 5 20 ") + order);
    EXPECT_EQ(source->info().dims, (Index3{7, 5, 20}));
    EXPECT_TRUE(source->traits().again && source->traits().whole_slices && !source->traits().any_rows);
    EXPECT_TRUE(source->facts().holds_other_bytes);
    EXPECT_EQ(source->bytes_read(), std::string(order).size() + 7);
    std::mt19937 random(1);
    for (int i = 0; i < 40; ++i) {
      const auto from = static_cast<std::int64_t>(random() % 20);
      source->seek_slice(from);
      expect_slices(*source, 1 + static_cast<std::int64_t>(random()) % (20 - from));
    }
    source->rewind();
    for (int z = 0; z < 20; z += 4) expect_slices(*source, 4);
    source->finish();
  }
}

TEST_F(ProgramSourceTest, ADescriptionTakesNoMoreMemoryThanItMay) {
  if (sanitized) GTEST_SKIP() << "sanitizers take memory of their own";
  const std::string greedy = file("a.ramp", "7 5 3 greedy");
  const auto open_with = [&](std::uint64_t mebibytes) {
    return open_with_reader(TAGRID_RAMP_READER, greedy, {}, mebibytes << 20);
  };
  try {
    open_with(64);
    ADD_FAILURE() << "nothing was thrown";
  } catch (const UsageError& error) {
    EXPECT_EQ(error.what(),
              greedy + ": to describe it, its reader needs more memory than its limit (64 MiB)");
    EXPECT_EQ(error.detail().problem, Problem::program_memory);
  }
  const auto source = open_with(512);
  expect_slices(*source, 3);
}

TEST_F(ProgramSourceTest, AnErrorBetweenSlicesComesAtItsSlice) {
  const auto source = open("7 5 20 broken");
  expect_slices(*source, 2);
  EXPECT_EQ(message_of<BrokenInput>([&] { expect_slices(*source, 1); }), "slice 2 cannot be read");
}

TEST_F(ProgramSourceTest, AFileThatChangesIsNoticedWhenItIsReadAgain) {
  const auto source = open("7 5 20 next");
  expect_slices(*source, 3);
  file("a.ramp", "7 5 21 next");
  source->rewind();
  EXPECT_THROW(expect_slices(*source, 1), BrokenInput);
}

/// The processes of ramp readers that this thread has started.
std::vector<int> readers() {
  std::vector<int> found;
  std::ifstream children("/proc/thread-self/children");
  for (int process; children >> process;) {
    std::ifstream name(fmt::format("/proc/{}/comm", process));
    if (std::string text; std::getline(name, text) && text == "ramp_reader") found.push_back(process);
  }
  return found;
}

TEST_F(ProgramSourceTest, EachSourceHasATwinOfOneProgram) {
  if (sanitized) GTEST_SKIP() << "sanitized programs make no twins";
  const auto a = open_with_reader(TAGRID_RAMP_READER, file("a.ramp", "7 5 20 any"), {});
  const std::size_t before = readers().size();
  EXPECT_EQ(before, 2u);  // with the one that opens no file
  const auto b = open_with_reader(TAGRID_RAMP_READER, file("b.ramp", "3 2 9 any"), {});
  EXPECT_EQ(readers().size(), 3u);
  for (int i = 0; i < 3; ++i) {
    expect_slices(*a, 2);
    expect_slices(*b, 3);
  }
}

TEST_F(ProgramSourceTest, AProgramThatSomebodyEndedIsStartedAgain) {
  if (sanitized) GTEST_SKIP() << "sanitized programs make no twins";
  open("7 5 20 any");
  for (const int process : readers()) kill(process, SIGKILL);
  expect_slices(*open("7 5 20 any"), 20);
}

TEST_F(ProgramSourceTest, ErrorsAndListsArrive) {
  EXPECT_THROW(open("7 5"), BrokenInput);
  try {
    open_with_reader(TAGRID_RAMP_READER, file("a.ramp", "7 5 3 any"), {{"series", "all"}});
    ADD_FAILURE() << "nothing was thrown";
  } catch (const UsageError& error) {
    EXPECT_THAT(
        error.detail().choices,
        testing::ElementsAre(Choice{"a", "the first"}, Choice{"b", "the second"}, Choice{"a", "the third"}));
  }
}

TEST_F(ProgramSourceTest, ANameOfTwoVolumesMeansNeither) {
  const std::string path = file("a.ramp", "7 5 3 any");
  EXPECT_EQ(message_of<UsageError>([&] {
              open_with_reader(TAGRID_RAMP_READER, path, {{"series", "a"}});
            }),
            path + ": has 2 volumes that are called a; move the files of one of them to another directory");
  // Other names, and numbers, say which.
  for (const char* series : {"b", "1", "3"})
    EXPECT_TRUE(open_with_reader(TAGRID_RAMP_READER, path, {{"series", series}}));
  EXPECT_THROW(open_with_reader(TAGRID_RAMP_READER, path, {{"series", "4"}}), UsageError);
}

TEST_F(ProgramSourceTest, SamplesThatLiePlainlyAreReadWithoutTheProgram) {
  const std::string program = reader(
      R"(echo '{"answer": "volume", "dims": [2, 1, 3], "type": "uint16", "places": [{"offset": 1, "slices": 3, "big_endian": true}]}'
while read -r line; do echo more; done
)");
  const auto source = open_with_reader(program,
                                       file("a.x",
                                            "\x7f"
                                            "ABCDEFGHIJKL"),
                                       {});
  EXPECT_TRUE(source->traits().any_rows);
  std::uint16_t samples[6];
  source->read_slices(reinterpret_cast<std::byte*>(samples), 3);
  EXPECT_THAT(samples, testing::ElementsAre(0x4142, 0x4344, 0x4546, 0x4748, 0x494a, 0x4b4c));
  // Where they should lie and do not.
  EXPECT_THROW(open_with_reader(program,
                                file("b.x",
                                     "\x7f"
                                     "ABCDEFGHIJK"),
                                {}),
               BrokenInput);
}

TEST_F(ProgramSourceTest, AReaderMayDeclareMoreMemoryThanItDescribesWith) {
  const std::string program =
      reader(R"(echo '{"answer": "volume", "dims": [1, 1, 1], "type": "uint8", "memory": 3000000000}'
read -r line
echo "{\"answer\": \"slices\", \"from\": 0, \"to\": 1}"
limit=$(ulimit -d)
if [ "$limit" = unlimited ] || [ "$limit" -gt 2000000 ]; then printf 1; else printf 0; fi
)");
  const auto source = open_with_reader(program, file("a.x", ""), {});
  char sample = 0;
  source->read_slices(reinterpret_cast<std::byte*>(&sample), 1);
  EXPECT_EQ(sample, '1');
}

// A reader that gives too much has most likely misread its file.
TEST_F(ProgramSourceTest, BytesAfterTheLastSliceAreAnErrorThatNamesTheReader) {
  const std::string program =
      reader(R"(echo '{"answer": "volume", "dims": [2, 1, 3], "type": "uint8", "order": "'$(cat $0.order)'"}'
read -r line
echo '{"answer": "slices", "from": 0, "to": 3}'
printf "abcdef%$(cat $0.more)s" ''
read -r line
exit $(cat $0.code)
)");
  for (const char* order : {"any", "next"})
    for (const auto& [more, code] : {std::pair("0", "0"), {"1", "0"}, {"1000", "0"}, {"0", "3"}}) {
      SCOPED_TRACE(std::string(order) + " " + more + " " + code);
      file("reader.order", order);
      file("reader.more", more);
      file("reader.code", code);
      const auto source = open_with_reader(program, file("a.x", ""), {});
      std::byte samples[6];
      source->read_slices(samples, 3);
      const bool is_good = *more == '0' && *code == '0';
      try {
        source->finish();
        EXPECT_TRUE(is_good);
      } catch (const WorldError& error) {
        EXPECT_FALSE(is_good) << error.what();
        EXPECT_THAT(error.what(), HasSubstr(program));
      }
      if (!is_good) continue;
      // It can be read again.
      source->rewind();
      source->read_slices(samples, 3);
      EXPECT_EQ(samples[5], std::byte{'f'});
    }
}

TEST_F(ProgramSourceTest, AReadThatWaitsCanBeStopped) {
  const std::string program = reader(R"(echo '{"answer": "volume", "dims": [2, 1, 3], "type": "uint16"}'
sleep 1000
)");
  const auto source = open_with_reader(program, file("a.x", ""), {});
  const std::atomic<bool> stop = true;
  source->stop_when(stop);
  std::uint16_t samples[6];
  EXPECT_THROW(source->read_slices(reinterpret_cast<std::byte*>(samples), 3), WorldError);
}

// Writers that do as docs/dev/readers.md says, and writers that do not.

using testing::ElementsAre;
using testing::HasSubstr;

const VolumeInfo info{{4, 3, 5}, SampleType::int16};
constexpr int slice_bytes = 24;

const std::string hello = R"(echo '{"tagrid-writer": 1, "name": "test", "version": "1"}')";
const std::string ready = R"(echo '{"answer": "ready", "memory": 100000000}')";
const std::string done = R"(echo '{"answer": "done", "facts": {"slices": 5}}')";

class ProgramSinkTest : public TemporaryFolder {
 protected:
  ProgramSinkTest() {
    for (std::size_t i = 0; i < samples_.size(); ++i) samples_[i] = static_cast<std::byte>(i);
  }

  /// A script of a shell: `begin`; then, when it was asked to write, `at_write`; `at_slice` for every slice, which it must
  /// take from its input; `at_finish` in the end.
  std::string writer(const std::string& at_write = ready, const std::string& at_slice = take,
                     const std::string& at_finish = done, const std::string& begin = hello) const {
    const std::string find_path = R"sh(path=$(printf %s "$line" | sed 's/.*"path":"\([^"]*\)".*/\1/'))sh";
    const std::string script = "#!/bin/sh\n" + begin + "\nread -r line\n" + find_path + "\n" + at_write +
                               "\nwhile read -r line; do\n  case $line in\n    *finish*) " + at_finish +
                               " ;;\n    *) " + at_slice + " ;;\n  esac\ndone\n";
    const std::string name = file("writer", script);
    chmod(name.c_str(), 0700);
    return name;
  }
  static inline const std::string take = "head -c 24 >> \"$path\"";

  void write_all(const std::string& program) const {
    const auto sink = create_with_writer(program, path("a.x"), info, {}, {});
    for (int z = 0; z < 5; ++z)
      sink->write_slices(std::span(samples_).subspan(static_cast<std::size_t>(z * slice_bytes), slice_bytes));
    sink->commit();
  }

  /// The message of the error with which writing fails. Nothing may be left.
  template <class Error = WorldError>
  std::string failure(const std::string& program) const {
    const std::string message = message_of<Error>([&] { write_all(program); });
    EXPECT_THAT(names(), ElementsAre("writer"));
    return message;
  }

  std::array<std::byte, 5 * slice_bytes> samples_;
};

TEST_F(ProgramSinkTest, TheWriterGetsEverySampleAndTheFileAppearsAtTheEnd) {
  const auto sink = create_with_writer(
      writer(R"(echo '{"answer": "ready", "memory": 12345678, "warnings": ["take care"]}')"), path("a.x"),
      info, {}, {});
  EXPECT_EQ(sink->memory(), 12345678u);
  EXPECT_THAT(sink->warnings(), ElementsAre("take care"));
  EXPECT_FALSE(sink->any_order());
  // Parts of slices, which do not end where slices do.
  for (std::size_t first = 0; first < samples_.size(); first += 10)
    sink->write_slices(
        std::span(samples_).subspan(first, std::min<std::size_t>(10, samples_.size() - first)));
  EXPECT_FALSE(std::filesystem::exists(path("a.x")));
  EXPECT_EQ(sink->facts(), R"({"slices":5})");
  EXPECT_EQ(sink->bytes_written(), samples_.size());
  sink->commit();
  EXPECT_EQ(content("a.x"), std::string(reinterpret_cast<const char*>(samples_.data()), samples_.size()));
}

TEST_F(ProgramSinkTest, TheWriterLearnsAllThatIsKnownOfTheVolume) {
  const std::string fields = "spacings: 0.5 1 2\nunits: \"mm\" \"mm\" \"mm\"\nkey:=a value\n";
  const VolumeInfo known{info.dims, info.type, parse_metadata(fields)};
  const auto sink = create_with_writer(writer("printf '%s\\n' \"$line\" > \"$path.request\"; " + ready),
                                       path("a.x"), known, {}, {{"level", "9"}});
  std::string request;
  for (const std::string& name : names())
    if (name.ends_with(".request")) request = content(name);
  for (const char* part :
       {R"("request":"write")", R"("dims":[4,3,5])", R"("type":"int16")", R"("spacing":[0.5,1.0,2.0])",
        R"("units":"mm")", R"("pairs":{"key":"a value"})", R"("options":{"level":"9"})"})
    EXPECT_THAT(request, HasSubstr(part));
  EXPECT_THAT(request, HasSubstr("\"name\":\"" + path("a.x") + "\""));
}

TEST_F(ProgramSinkTest, SignsOfLifeMayComeAtAnyTime) {
  const std::string alive = R"(echo '{"answer": "working"}'; )";
  write_all(writer(alive + ready, alive + take, alive + done));
  EXPECT_EQ(content("a.x").size(), samples_.size());
}

TEST_F(ProgramSinkTest, ErrorsOfTheWriterAreThoseOfTheUser) {
  const auto error = [](const std::string& kind) {
    return R"(echo '{"answer": "error", "kind": ")" + kind + R"(", "message": "a.x: cannot be"}'; exit)";
  };
  EXPECT_EQ(failure<UsageError>(writer(error("usage"))), "a.x: cannot be");
  EXPECT_EQ(failure<WorldError>(writer(error("world"))), "a.x: cannot be");
  // While samples come, and when all have come.
  EXPECT_EQ(failure<UsageError>(writer(ready, error("usage"))), "a.x: cannot be");
  EXPECT_EQ(failure<WorldError>(writer(ready, take, error("world"))), "a.x: cannot be");
}

TEST_F(ProgramSinkTest, WhatAWriterDoesWrongNamesIt) {
  const auto fails_with = [&](const std::string& program, const char* message) {
    EXPECT_THAT(failure(program), HasSubstr(message));
  };
  fails_with(writer(ready, take, done, "echo hello"), "does not begin as a writer does");
  fails_with(writer(ready, take, done, R"(echo '{"tagrid-reader": 1, "name": "test"}')"),
             "does not begin as a writer does");
  fails_with(writer(ready, take, done, R"(echo '{"tagrid-writer": 2, "name": "test"}')"), "speaks version 2");
  fails_with(writer("echo words"), "is not a JSON object");
  fails_with(writer(R"(echo '{"answer": "ready"}')"), "does not say how much memory it takes");
  fails_with(writer(R"(echo '{"answer": "ready", "memory": -5}')"), "memory");
  fails_with(writer(R"(echo '{"answer": "ready", "memory": "much"}')"), "memory");
  fails_with(writer(R"(echo '{"answer": "unknown"}')"), "instead of \"ready\"");
  fails_with(writer("echo 'no room' >&2; exit 3"), "exited with code 3");
  fails_with(writer(ready, "echo 'no room' >&2; exit 3"), "stderr: no room");
  fails_with(writer(ready, "kill -SEGV $$"), "by signal 11");
  fails_with(writer(ready, take + "; echo words"), "is not a JSON object");
  fails_with(writer(ready, take + "; " + done), "writer: ");
  fails_with(writer(ready, take, "exit 0"), "exited with code 0 before it answered");
  fails_with(writer(ready, take, R"(echo '{"answer": "done", "facts": 5}')"), "\"facts\" is not an object");
  fails_with(writer(ready, take, done + "; echo more"), "sent unexpected output");
  fails_with(writer(ready, take, done + "; exit 4"), "exited with code 4");
  fails_with(writer(ready, take, "rm \"$path\"; " + done), "removed or replaced the file");
}

}  // namespace
}  // namespace tagrid
