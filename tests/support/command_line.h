// A directory with a volume, and calls of the program in it.
#pragma once

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/process.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {

// The program under test is the one that was built with the tests, unless the environment variable
// TAGRID_SANITIZED_PROGRAM names one that was built with sanitizers: then its tests need no second build.
inline const char* sanitized_program() { return std::getenv("TAGRID_SANITIZED_PROGRAM"); }

inline std::string program_under_test() { return sanitized_program() ? sanitized_program() : TAGRID_PROGRAM; }

inline bool program_is_sanitized() { return sanitized || sanitized_program(); }

constexpr int usage = 64, broken_input = 65, world = 74, held = 75;

/// The words of a command line, such as "encode a.nrrd -o a.tag"; none of them has a blank.
inline std::vector<std::string> words(const std::string& text) {
  std::istringstream in(text);
  return {std::istream_iterator<std::string>(in), {}};
}

class CommandLine : public TemporaryFolder {
 protected:
  using Arguments = std::vector<std::string>;

  /// Runs tagrid in the directory, with `input` on its standard input.
  Ending tagrid(Arguments arguments, std::string_view input = {}) const {
    arguments.insert(arguments.begin(), program_under_test());
    return Process(arguments, folder_.string()).finish(input);
  }
  /// Runs a bash script in the directory; $TAGRID is the program. The code is that of the first command of a
  /// pipeline that fails.
  Ending script(const std::string& text) const {
    const std::string preamble = "set -o pipefail; TAGRID='" + program_under_test() + "'; ";
    return Process({"bash", "-c", preamble + text}, folder_.string()).finish();
  }

  /// Expects an error: its code, and one line that contains `what`.
  static void expect_error(const Ending& ending, int code, std::string_view what) {
    EXPECT_EQ(ending.code, code) << ending.err;
    EXPECT_EQ(ending.signal, 0);
    EXPECT_EQ(ending.err.rfind("tagrid: ", 0), 0U) << ending.err;
    EXPECT_EQ(std::count(ending.err.begin(), ending.err.end(), '\n'), 1) << ending.err;
    EXPECT_TRUE(has(ending.err, what));
  }
  static void expect_ok(const Ending& ending) {
    EXPECT_EQ(ending.code, 0) << ending.err << " signal " << ending.signal;
    EXPECT_EQ(ending.err, "");
  }
  /// Runs the words of a command line, and expects that nothing is amiss.
  void works(const std::string& line) const {
    SCOPED_TRACE(line);
    expect_ok(tagrid(words(line)));
  }
  /// Runs the words of a command line, and expects an error.
  void fails(const std::string& line, int code, std::string_view what) const {
    SCOPED_TRACE(line);
    expect_error(tagrid(words(line)), code, what);
  }
  /// Runs the words of a command line, and gives what it writes to standard output.
  std::string out(const std::string& line, std::string_view input = {}) const {
    const Ending ending = tagrid(words(line), input);
    EXPECT_EQ(ending.code, 0) << line << ": " << ending.err;
    return ending.out;
  }
  /// What tagrid info tells of a .tag file.
  nlohmann::json info(const std::string& name) const {
    return nlohmann::json::parse(out("info --json " + name));
  }

  /// Makes a phantom in the directory, in the format of its name; by default 52 x 40 x 36 samples.
  void phantom(const std::string& name, const Arguments& more = {}) const {
    Arguments arguments = {"phantom", "--dims", "52,40,36", "-o", name, "-q"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    expect_ok(tagrid(arguments));
  }
  /// Makes volume.nrrd, and volume.tag from it.
  void make_tag(const Arguments& more = {}) const {
    phantom("volume.nrrd");
    Arguments arguments = {"encode", "volume.nrrd"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    expect_ok(tagrid(arguments));
  }
  nlohmann::json json_of(const std::string& name) const { return nlohmann::json::parse(content(name)); }

  struct stat status_of(const std::string& name) const {
    struct stat status = {};
    EXPECT_EQ(stat(path(name).c_str(), &status), 0) << name;
    return status;
  }

  const Arguments raw_ = {"--dims", "52,40,36", "--type", "int16"};
  static Arguments with(Arguments first, const Arguments& second) {
    first.insert(first.end(), second.begin(), second.end());
    return first;
  }
};

/// The samples of an attached NRRD file: the bytes after the blank line.
inline std::string samples_of(const std::string& nrrd) { return nrrd.substr(nrrd.find("\n\n") + 2); }

}  // namespace tagrid
