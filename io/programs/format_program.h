// A program that reads or writes a format, while it runs. It knows lines and bytes; what they mean is known
// to io/programs/reader_conversation.h and io/programs/writer_conversation.h.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "io/system/processes.h"
#include "io/volume/volume_info.h"

namespace tagrid {

/// A program that is asked by lines on its standard input, and answers on its standard output. It is a
/// process group of its own, which ends with this object, or with the thread that made it. Every failure of
/// the program (it cannot be started, dies, is silent, says too much) is a WorldError that names it and
/// quotes the end of its standard error.
class FormatProgram {
 public:
  struct Limits {
    std::chrono::milliseconds silence{60'000};  ///< without a byte from the program while one is waited for
    std::size_t line = std::size_t{1} << 24;    ///< bytes of an answer
    std::uint64_t memory = most_first_memory;   ///< bytes of memory of its own, until limit_memory()
  };

  /// Starts the program at an absolute path.
  explicit FormatProgram(const std::string& program, const Limits& limits);
  /// Takes a twin that a program at this path started as `twin.process`; see ask_for_twin().
  FormatProgram(const std::string& program, Child twin, const Limits& limits);
  ~FormatProgram();
  FormatProgram(const FormatProgram&) = delete;
  FormatProgram& operator=(const FormatProgram&) = delete;

  /// Sends a line; `line` is without its '\n'.
  void say(std::string_view line);
  /// Sends a line that asks for a twin of the program; the program answers with its number. Returns its streams.
  Child ask_for_twin(std::string_view line);
  /// Sends bytes, and returns how many: all, unless the program says something meanwhile, or ends after it
  /// said something. Then hear() has it, and the rest can be sent afterwards.
  std::size_t write(const std::byte* bytes, std::size_t size);
  /// True if hear() need not wait: a complete line of the program has arrived.
  bool has_line() const { return heard_.find('\n') != heard_.npos; }
  /// The next line of the program, without its '\n'.
  std::string hear();
  /// Fills `out` with the next bytes of the program.
  void read(std::byte* out, std::size_t size);
  /// Closes the program's input, and waits for its end. The program must say nothing more, and end with code
  /// 0.
  void finish();
  /// From now on, the program may have so many bytes of memory of its own. Memory that it has stays.
  void limit_memory(std::uint64_t bytes);

  /// From now on, a call that waits throws WorldError as soon as `stop` is true. `stop` must outlive the
  /// calls.
  void stop_when(const std::atomic<bool>& stop) { stop_ = &stop; }
  /// For messages: from now on, the program reads this file, or writes it, and whatever is wrong with one is
  /// said of both.
  void reads(const std::string& path) { file_ = path; }
  void writes(const std::string& path) {
    file_ = path;
    is_reader_ = false;
  }
  /// For messages: the path of the program.
  const std::string& program() const { return program_; }
  /// A WorldError about the program, with the end of its standard error.
  [[noreturn]] void fail(std::string_view what) { fail(what, false); }
  /// An error of a program that lacks memory, as it has said in this message: a UsageError with the problem
  /// `program_memory` if it could have more, otherwise a WorldError.
  [[noreturn]] void fail_for_memory(const std::string& message) const;

 private:
  /// A BrokenInput, if the input is what made it fail.
  [[noreturn]] void fail(std::string_view what, bool may_lack_memory, bool by_input = false);
  /// The child, or a WorldError if it could not be started.
  Child taken(StartedChild started) const;
  enum class For { output, input, either };
  /// Waits until the program says something or ends (its output), or takes bytes (its input). True if its
  /// output is ready.
  bool wait(For what);
  void listen_to_errors();
  /// Keeps the output of the program that has arrived. Returns false at the end of its output.
  bool listen();
  /// Reads what has arrived; 0 at the end.
  std::size_t read_some(std::byte* out, std::size_t size);
  [[noreturn]] void fail_as_ended();
  static std::string in_words(const ChildEnding& ending);
  /// Waits a moment for its end.
  ChildEnding ending();
  void end();

  std::string program_;
  std::string file_;  ///< that it reads or writes, if any
  bool is_reader_ = true;
  bool has_first_memory_ = true;  ///< it has not said how much it needs
  Limits limits_;
  Child child_;
  const std::atomic<bool>* stop_ = nullptr;
  std::string heard_;  ///< bytes that were read and not yet given to the caller
  std::string last_words_;
};

/// The variables with which such programs are started, each as NAME=VALUE: those that they need to
/// start, to find their parts and to write temporary files, and LC_ALL=C. docs/dev/readers.md lists
/// them. Other variables of this process, such as cloud keys and tokens, are not passed on, because
/// these programs open untrusted files.
std::vector<std::string> environment_of_programs();

}  // namespace tagrid
