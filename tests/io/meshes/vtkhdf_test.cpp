// Programs that write a mesh as docs/readers.md says, and programs that do not.

#include "io/meshes/mesh_files.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>

#include "io/errors/errors.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class VtkhdfTest : public TemporaryFolder {
 protected:
  void SetUp() override {
    std::filesystem::create_directory(path("bin"));
    setenv("TAGRID_READER_PATH", path("bin").c_str(), 1);
  }
  void TearDown() override { unsetenv("TAGRID_READER_PATH"); }

  static inline const std::string hello = R"(echo '{"tagrid-writer": 1, "name": "test", "version": "1"}')";
  static inline const std::string ready = R"(echo '{"answer": "ready", "memory": 90000000}')";
  static inline const std::string done = R"(echo '{"answer": "done"}')";
  static inline const std::string take = R"(head -c "$size" >> "$path")";

  /// A script of a shell: `begin`; then, when it was asked to write, `at_write`; `at_array` for each piece, which it must
  /// take from its input; `at_finish` in the end.
  void make_writer(const std::string& at_write = ready, const std::string& at_array = take,
                   const std::string& at_finish = done, const std::string& begin = hello) const {
    const std::string script =
        "#!/bin/sh\n" + begin + "\nread -r line\n" +
        R"sh(path=$(printf %s "$line" | sed 's/.*"path":"\([^"]*\)".*/\1/'))sh" + "\n" + at_write +
        "\nwhile read -r line; do\n  case $line in\n    *positions*) size=120 ;;\n    *connectivity*) "
        "size=64 "
        ";;\n    *value*) size=10 ;;\n    *) size=2 ;;\n  esac\n  case $line in\n    *finish*) " +
        at_finish + " ;;\n    *) " + at_array + " ;;\n  esac\ndone\n";
    chmod(file("bin/tagrid-write-hdf5", script).c_str(), 0700);
  }

  /// Five points and two tetrahedra.
  void write(VtkhdfFile& mesh) const {
    std::vector<double> xyz(15);
    for (std::size_t i = 0; i < xyz.size(); ++i) xyz[i] = static_cast<double>(i);
    const std::vector<std::int16_t> values = {-1, 2, 3, 4, 5};
    mesh.add_points(xyz, std::as_bytes(std::span(values)));
    mesh.add_tetrahedra(std::vector<std::int64_t>{0, 1, 2, 3, 1, 2, 3, 4},
                        std::vector<std::uint8_t>{'d', 'h'});
    mesh.finish();
  }
  void write_all() const {
    VtkhdfFile mesh(path("a.vtkhdf"), SampleType::int16, false);
    write(mesh);
    mesh.commit();
  }

  /// The message of the error with which writing fails. Nothing may be left.
  template <class Error = WorldError>
  std::string failure() const {
    std::string message;
    try {
      write_all();
      ADD_FAILURE() << "nothing was thrown";
    } catch (const Error& error) {
      message = error.what();
    }
    EXPECT_THAT(names(), ElementsAre("bin"));
    return message;
  }
};

TEST_F(VtkhdfTest, TheWriterGetsEveryArrayAndTheFileAppearsAtTheEnd) {
  make_writer(R"(printf '%s\n' "$line" > "${0%/*}/../request"; )" + ready,
              R"(printf '%s\n' "$line" >> "${0%/*}/../requests"; )" + take);
  VtkhdfFile mesh(path("a.vtkhdf"), SampleType::int16, false);
  write(mesh);
  EXPECT_FALSE(std::filesystem::exists(path("a.vtkhdf")));
  EXPECT_EQ(mesh.file_bytes(), 120u + 64 + 10 + 2 + 2);
  mesh.commit();

  const std::string request = content("request");
  for (const char* part : {R"("request":"write-mesh")", R"("points":5)", R"("tetrahedra":2)",
                           R"("point_data":[{"name":"value","type":"int16"}])",
                           R"("cell_data":[{"name":"level","type":"uint8"},{"name":"type","type":"uint8"}])",
                           R"("options":{"format":"vtkhdf"})"})
    EXPECT_THAT(request, HasSubstr(part));
  EXPECT_THAT(request, HasSubstr("\"name\":\"" + path("a.vtkhdf") + "\""));
  EXPECT_EQ(content("requests"),
            "{\"from\":0,\"name\":\"positions\",\"request\":\"array\",\"to\":5}\n"
            "{\"from\":0,\"name\":\"connectivity\",\"request\":\"array\",\"to\":2}\n"
            "{\"from\":0,\"name\":\"value\",\"request\":\"array\",\"to\":5}\n"
            "{\"from\":0,\"name\":\"level\",\"request\":\"array\",\"to\":2}\n"
            "{\"from\":0,\"name\":\"type\",\"request\":\"array\",\"to\":2}\n");
  const std::string bytes = content("a.vtkhdf");
  EXPECT_EQ(bytes.substr(0, 16), std::string(14, '\0') + "\xf0\x3f") << "0.0, and 1.0";
  EXPECT_EQ(bytes.substr(120 + 8, 8), std::string("\1\0\0\0\0\0\0\0", 8));
  EXPECT_EQ(bytes.substr(184, 4), std::string("\xff\xff\2\0", 4));
  EXPECT_EQ(bytes.substr(194), std::string("dh\1\2", 4))
      << "levels, and what is left of them if divided by 3";
}

TEST_F(VtkhdfTest, SignsOfLifeMayComeAtAnyTime) {
  const std::string alive = R"(echo '{"answer": "working"}'; )";
  make_writer(alive + ready, alive + take, alive + done);
  write_all();
  EXPECT_EQ(content("a.vtkhdf").size(), 198u);
}

TEST_F(VtkhdfTest, ErrorsOfTheWriterAreThoseOfTheUser) {
  const auto error = [](const std::string& kind) {
    return R"(echo '{"answer": "error", "kind": ")" + kind + R"(", "message": "a.vtkhdf: cannot be"}'; exit)";
  };
  make_writer(error("usage"));
  EXPECT_EQ(failure<UsageError>(), "a.vtkhdf: cannot be");
  make_writer(ready, error("world"));
  EXPECT_EQ(failure<WorldError>(), "a.vtkhdf: cannot be");
  make_writer(ready, take, error("world"));
  EXPECT_EQ(failure<WorldError>(), "a.vtkhdf: cannot be");
}

TEST_F(VtkhdfTest, WhatAWriterDoesWrongNamesItAndLeavesNothing) {
  const auto fails_with = [&](const char* message) { EXPECT_THAT(failure(), HasSubstr(message)); };
  make_writer(ready, take, done, "echo hello");
  fails_with("does not begin as a writer does");
  make_writer(R"(echo '{"answer": "unknown"}')");
  fails_with("instead of \"ready\"");
  make_writer(R"(echo '{"answer": "ready"}')");
  fails_with("does not say how much memory it takes");
  make_writer(R"(echo '{"answer": "ready", "memory": 1000000000}')");
  fails_with("wants 1000000000 bytes of memory");
  make_writer("kill -KILL $$");
  fails_with("by signal 9");
  // In the middle of an array, between arrays, and before the end.
  make_writer(ready, "head -c 50 > /dev/null; kill -KILL $$");
  fails_with("by signal 9");
  make_writer(ready, take + "; case $line in *connectivity*) echo 'no room' >&2; exit 3 ;; esac");
  fails_with("stderr: no room");
  make_writer(ready, take, "exit 0");
  fails_with("exited with code 0 before it answered");
  make_writer(ready, take + "; " + done);
  fails_with("tagrid-write-hdf5: ");
  make_writer(ready, take, done + "; exit 4");
  fails_with("exited with code 4");
  make_writer(ready, take, R"(rm "$path"; )" + done);
  fails_with("removed or replaced the file");
  make_writer(ready, take, R"(mv "$path" "$path.x"; cp "$path.x" "$path"; rm "$path.x"; )" + done);
  fails_with("removed or replaced the file");
}

TEST_F(VtkhdfTest, AnExistingFileStays) {
  make_writer();
  file("a.vtkhdf", "mine");
  EXPECT_THROW(write_all(), UsageError);
  EXPECT_EQ(content("a.vtkhdf"), "mine");
}

}  // namespace
}  // namespace tagrid
