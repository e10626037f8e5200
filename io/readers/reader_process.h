// A reader program that runs. It knows lines and bytes; io/readers/conversation.h knows what they mean.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace tagrid {

/// A program that is asked by lines on its standard input, and answers on its standard output. It is a process group of
/// its own, which ends with this object, or with the thread that made it. Every failure of the program (it cannot be
/// started, dies, is silent, says too much) is a WorldError that names it and quotes its last words on standard error.
class ReaderProcess {
 public:
  struct Limits {
    std::chrono::milliseconds silence{60'000};  ///< without a byte from the program while one is waited for
    std::size_t line = std::size_t{1} << 24;    ///< bytes of an answer
    std::uint64_t memory = std::uint64_t{1} << 30;  ///< bytes of memory of its own, at the beginning
  };

  /// Starts the program at an absolute path.
  explicit ReaderProcess(const std::string& program, const Limits& limits);
  ~ReaderProcess();
  ReaderProcess(const ReaderProcess&) = delete;
  ReaderProcess& operator=(const ReaderProcess&) = delete;

  /// Sends a line; `line` is without its '\n'.
  void say(std::string_view line);
  /// The next line of the program, without its '\n'.
  std::string hear();
  /// Fills `out` with the next bytes of the program.
  void read(std::byte* out, std::size_t size);
  /// Closes the program's input, and waits for its end. The program must say nothing more, and end with code 0.
  void finish();
  /// From now on, the program may have so many bytes of memory of its own. Memory that it has stays.
  void limit_memory(std::uint64_t bytes);

  /// From now on, a call that waits throws WorldError as soon as `stop` is true. `stop` must outlive the calls.
  void stop_when(const std::atomic<bool>& stop) { stop_ = &stop; }
  /// For messages: the path of the program.
  const std::string& program() const { return program_; }
  /// A WorldError about the program, with its last words.
  [[noreturn]] void fail(std::string_view what);

 private:
  void start();
  /// Waits until the program takes bytes (`to_say`), or until it says something or ends.
  void wait(bool to_say);
  void listen_to_errors();
  /// Reads what is there; 0 at the end.
  std::size_t read_some(std::byte* out, std::size_t size);
  [[noreturn]] void fail_as_ended();
  std::string ending();
  void end();

  std::string program_;
  Limits limits_;
  pid_t process_ = -1;
  int input_ = -1, output_ = -1, errors_ = -1;
  const std::atomic<bool>* stop_ = nullptr;
  std::string heard_;  ///< bytes that were read and not yet given to the caller
  std::string last_words_;
};

}  // namespace tagrid
