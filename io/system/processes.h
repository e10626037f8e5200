// Programs that this process starts, and talks to.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/system/files.h"

namespace tagrid {

/// A program that runs. Its streams do not block: they fail with EAGAIN, and wait_for() waits for them.
struct Child {
  int process = -1;
  Descriptor input;  ///< takes what send_bytes() sends
  Descriptor output, errors;
};

struct StartedChild {
  enum class Failure { none, pipe, process, program } failure = Failure::none;
  int error = 0;  ///< an errno, if there is a failure
  Child child = {};
};

/// How a program ended.
struct ChildEnding {
  enum class Kind { none, exit, signal } kind = Kind::none;  ///< none: it still runs
  int number = 0;                                            ///< the exit code, or the signal
  bool is_crash = false;  ///< a signal for a wrong access or calculation; others may send any other signal
};

class Processes {
 public:
  virtual ~Processes() = default;
  /// Starts the program at a path with this environment, NAME=VALUE each, and at most so much memory of its
  /// own. It is a process group of its own, and ends with the thread that started it.
  virtual StartedChild start(const std::string& program, std::vector<std::string> environment,
                             std::uint64_t memory) = 0;
  /// Asks a program that start() started for a twin: a copy of it as it is now, which is another child of this process.
  /// Sends `request` with the other ends of the streams that are returned; the program answers with the number of the
  /// twin.
  virtual StartedChild ask_for_twin(const Child& program, std::string_view request) = 0;
  /// Takes the twin with this number, and limits its memory. Returns false if it is not a child of this process.
  virtual bool take_twin(int process, std::uint64_t memory) = 0;
  /// From now on, it may have so many bytes of memory of its own; what it has stays. Returns 0 or an errno.
  virtual int limit_memory(int process, std::uint64_t bytes) = 0;
  /// Waits for its end, for at most so long.
  virtual ChildEnding ending(int process, std::chrono::milliseconds most) = 0;
  /// Ends it at once, with all that it has started in its group.
  virtual void kill(int process) = 0;
};

Processes& processes_of_system();
/// Those of the system, unless a ProcessesInstead exists.
Processes& processes();

/// For tests: while it exists, processes() is another one.
class ProcessesInstead {
 public:
  explicit ProcessesInstead(Processes& processes);
  ~ProcessesInstead();
  ProcessesInstead(const ProcessesInstead&) = delete;
  ProcessesInstead& operator=(const ProcessesInstead&) = delete;

 private:
  Processes* before_;
};

/// What ends the names of programs, and what separates the directories in a list of them.
std::string_view end_of_program_names();
char separator_of_folders();

// In a program that start() started.

/// The streams of a twin: they come with the request for it.
struct TwinStreams {
  Descriptor input, output, errors;
};

/// False if no program of this system can start a twin of itself.
bool can_start_twins();
/// Receives bytes of the standard input, and streams for a twin if they come with them. Returns the number of bytes, 0
/// at the end.
std::ptrdiff_t receive_request(std::span<char> to, TwinStreams& streams);
/// Starts a twin of this process with these streams; `answers` then leads to its output. Returns its number, 0 in the
/// twin itself, or a negative number; errno says why. REQUIRES: this process has one thread.
int start_twin(const TwinStreams& streams, std::FILE* answers);

/// "Segmentation fault"
std::string name_of_signal(int number);

/// Sends bytes to the input of a child, or on a connection; returns their number. EPIPE or ECONNRESET: nobody
/// takes them.
std::ptrdiff_t send_bytes(int socket, std::span<const std::byte> bytes);
/// Tells the other side that no more bytes come.
void end_sending(int socket);

}  // namespace tagrid
