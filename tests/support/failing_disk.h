// Runs the program and makes each of its calls on a file fail; see tests/faults/fault_injection.cpp.
#pragma once

#include <cstdlib>
#include <iostream>
#include <map>

#include "tests/support/command_line.h"

namespace tagrid {

// Every call takes minutes, so it is every seventh one, unless TAGRID_LONG is set. With sanitizers, that
// would still take too long.
inline const std::size_t stride = program_is_sanitized() ? 31 : std::getenv("TAGRID_LONG") != nullptr ? 1 : 7;

/// A number that the environment may give.
inline unsigned long number_in_environment(const char* name, unsigned long usual) {
  const char* given = std::getenv(name);
  return given ? std::strtoul(given, nullptr, 10) : usual;
}

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
  std::vector<std::string> arguments;   ///< see words()
  std::vector<std::string> older = {};  ///< files that exist before, to be overwritten
  bool streams = false;                 ///< standard input and output fail as well

  friend void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }
};

class FailingDisk : public CommandLine {
 protected:
  using Files = std::map<std::string, std::string>;

  mutable int runs_ = 0;

  ~FailingDisk() override {
    std::filesystem::remove(log());
    if (runs_ > 0) std::cout << runs_ << " runs of the program\n";
  }
  std::string log() const { return folder_.string() + ".calls"; }

  /// Every file with its bytes. Reports contain times, so only their completeness is compared.
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
                         program_under_test()};
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

  /// The name that a message about a call must contain.
  std::string expected_name(const Case& c, const Call& call) const {
    if (call.path.find("pipe:") == 0) return "standard ";
    const std::string name = std::filesystem::path(call.path).filename().string();
    if (c.arguments[0] == "restore") {
      // The directory of the files is also that of the report: the message is about one of them.
      if (name == "." || call.path == folder_.string()) return ": cannot ";
      if (name.starts_with(".restored.part")) return ".: ";
    }
    if (call.path.find("/.restored.part") != call.path.npos) return "volume.";
    const bool nameless = name.starts_with("#") || name == "." || call.path == folder_.string() ||
                          name.starts_with(".tagrid.spool");
    if (nameless) return c.streams ? "standard output" : "new.";
    const std::size_t mark = std::min(name.find(".part"), name.find(".old"));
    return mark == name.npos ? name : name.substr(1, mark - 1);
  }

  /// Failures that may be ignored, because the result is right without the call: closing a file that was
  /// read, setting times and owners if possible, setting older files aside if possible, and removing what
  /// killed runs left if possible.
  bool may_be_ignored(const Call& call) const {
    if (call.is_one_of({"close", "futimens", "fchmod", "fchown", "link"})) return true;
    // The empty file of a lock; the next run removes it.
    if (call.name == "unlink" && call.path.ends_with(".lock")) return true;
    // What cannot be removed by its name is removed with its directory, and the other way round.
    if (call.is_one_of({"unlink", "rmdir"}) && call.path.find(".restored.part") != call.path.npos)
      return true;
    // Unnamed files: another way exists. Pipes: they are not certain to be files.
    return (call.name == "open-to-write" &&
            std::filesystem::path(call.path).filename() == folder_.filename()) ||
           (call.name == "open-to-write" && call.path.ends_with("/.")) ||
           (call.name == "fstat" &&
            (call.path.find("pipe:") == 0 || call.path.find(".part") != call.path.npos));
  }
};

}  // namespace tagrid
