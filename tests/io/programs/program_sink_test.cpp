// Writers that do as docs/readers.md says, and writers that do not.

#include "io/metadata/text.h"
#include "io/programs/volumes.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <array>

#include "io/errors/errors.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

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
    std::string message;
    try {
      write_all(program);
      ADD_FAILURE() << "nothing was thrown";
    } catch (const Error& error) {
      message = error.what();
    }
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
