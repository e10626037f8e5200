#include "io/programs/format_program.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/close_range.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <thread>
#include <utility>
#include <vector>

#include "io/errors/errors.h"
#include "io/files/system_call.h"
#include "io/programs/environment.h"

namespace tagrid {
namespace {

using namespace std::chrono_literals;

using Steady = std::chrono::steady_clock;

constexpr std::size_t most_last_words = 2000;

// Both ends of a pipe or a pair of sockets, closed at the end unless they were taken.
class Ends {
 public:
  Ends() = default;
  ~Ends() {
    for (const int end : ends_)
      if (end >= 0) close(end);
  }
  Ends(const Ends&) = delete;
  Ends& operator=(const Ends&) = delete;

  int* data() { return ends_.data(); }
  int operator[](std::size_t i) const { return ends_[i]; }
  int take(std::size_t i) { return std::exchange(ends_[i], -1); }
  void drop(std::size_t i) { close(take(i)); }

 private:
  std::array<int, 2> ends_ = {-1, -1};
};

#ifdef TAGRID_SANITIZED
constexpr bool limits_memory = false;  // sanitizers take terabytes of addresses
#else
constexpr bool limits_memory = true;
#endif

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> all;
  for (std::string& text : texts) all.push_back(text.data());
  all.push_back(nullptr);
  return all;
}

// In the child, between fork() and exec(): only calls that are safe there.
[[noreturn]] void become(char* const* arguments, char* const* variables, int input, int output, int errors,
                         int report, pid_t parent, rlim_t memory) {
  setpgid(0, 0);
  // Memory of its own: not the code of libraries, nor files that are mapped. Only the soft limit, as a
  // description may ask for more.
  rlimit limit;
  if (limits_memory && getrlimit(RLIMIT_DATA, &limit) == 0) {
    limit.rlim_cur = std::min(memory, limit.rlim_max);
    setrlimit(RLIMIT_DATA, &limit);
  }
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(127);  // it died before the line above
  dup2(input, STDIN_FILENO);
  dup2(output, STDOUT_FILENO);
  dup2(errors, STDERR_FILENO);
  close_range(3, ~0U, CLOSE_RANGE_CLOEXEC);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  // Handlers are reset by exec(), but what is ignored stays so.
  for (const int ignored : {SIGPIPE, SIGINT, SIGTERM, SIGHUP}) signal(ignored, SIG_DFL);
  execve(arguments[0], arguments, variables);
  const int why = errno;
  [[maybe_unused]] const ssize_t written = write(report, &why, sizeof why);
  _exit(127);
}

// What a limit of memory counts although the program has never touched it: above all the stacks of threads,
// which libraries start when they are loaded.
std::uint64_t untouched_memory(pid_t process) {
  constexpr std::uint64_t most = std::uint64_t{128} << 20;
  std::uint64_t size = 0, resident = 0, of_files = 0, text = 0, unused = 0, data = 0;
  std::ifstream statm(fmt::format("/proc/{}/statm", process));
  if (!(statm >> size >> resident >> of_files >> text >> unused >> data) || resident < of_files) return 0;
  const std::uint64_t touched = resident - of_files;
  if (data < touched) return 0;
  return std::min(most, (data - touched) * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE)));
}

}  // namespace

FormatProgram::FormatProgram(const std::string& program, const Limits& limits)
    : program_(program), limits_(limits) {
  start();
}

FormatProgram::~FormatProgram() { end(); }

void FormatProgram::limit_memory(std::uint64_t bytes) {
  has_first_memory_ = false;
  rlimit limit;
  if (!limits_memory || prlimit(process_, RLIMIT_DATA, nullptr, &limit) != 0) return;
  limit.rlim_cur = std::min<rlim_t>(bytes + untouched_memory(process_), limit.rlim_max);
  if (prlimit(process_, RLIMIT_DATA, &limit, nullptr) != 0 && errno != ESRCH)
    throw world_error("cannot limit its memory", program_, errno);
}

void FormatProgram::start() {
  // The input is a socket, as writing to it can fail without a signal.
  Ends input, output, errors, report;
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, input.data()) != 0 ||
      pipe2(output.data(), O_CLOEXEC) != 0 || pipe2(errors.data(), O_CLOEXEC) != 0 ||
      pipe2(report.data(), O_CLOEXEC) != 0)
    throw world_error("cannot make a pipe to it", program_, errno);
  // A program that reads ahead is stopped less often. It is no harm if the system does not allow it.
  fcntl(output[1], F_SETPIPE_SZ, 1 << 20);
  std::vector<std::string> names = {program_}, texts = environment_of_programs();
  const std::vector<char*> arguments = pointers(names), variables = pointers(texts);
  const pid_t parent = getpid();
  process_ = fork();
  if (process_ < 0 && errno == EAGAIN)
    throw WorldError(
        program_ +
        ": cannot start a process for it, as there are too many; raise the limit on processes (ulimit -u)");
  if (process_ < 0) throw world_error("cannot start a process for it", program_, errno);
  if (process_ == 0)
    become(arguments.data(), variables.data(), input[1], output[1], errors[1], report[1], parent,
           limits_.memory);
  setpgid(process_, process_);  // whoever is first
  input.drop(1);
  output.drop(1);
  errors.drop(1);
  report.drop(1);
  int why = 0;
  if (uninterrupted([&] { return ::read(report[0], &why, sizeof why); }) > 0) {
    end();
    throw world_error("cannot start it", program_, why);
  }
  for (const int end : {input[0], output[0], errors[0]}) fcntl(end, F_SETFL, O_NONBLOCK);
  input_ = input.take(0);
  output_ = output.take(0);
  errors_ = errors.take(0);
}

bool FormatProgram::wait(For what) {
  constexpr auto look_again = 100ms;
  // Time counts only while poll() waits: this process may have been stopped.
  for (Steady::duration silence = 0ms;;) {
    std::array<pollfd, 3> ready = {{{what == For::input ? -1 : output_, POLLIN, 0},
                                    {what == For::output ? -1 : input_, POLLOUT, 0},
                                    {errors_, POLLIN, 0}}};
    const auto before = Steady::now();
    const int count = poll(ready.data(), ready.size(), static_cast<int>(look_again.count()));
    const auto waited = std::min<Steady::duration>(Steady::now() - before, look_again);
    if (stop_ != nullptr && *stop_) throw WorldError(program_ + ": its samples are no longer needed");
    if (count < 0 && errno != EINTR) throw world_error("cannot wait for it", program_, errno);
    if (count == 0) silence += waited;
    const bool answers = ready[0].revents != 0 || ready[1].revents != 0;
    if (count > 0 && ready[2].revents != 0) {
      listen_to_errors();
      // Words on standard error are no answer: a program that says nothing else is silent.
      if (!answers) silence += waited;
    }
    if (count > 0 && answers) return ready[0].revents != 0;
    if (silence >= limits_.silence)
      fail(fmt::format("did not answer for {} seconds",
                       std::chrono::duration_cast<std::chrono::seconds>(limits_.silence).count()));
  }
}

void FormatProgram::listen_to_errors() {
  std::array<char, 4096> bytes;
  const ssize_t count = ::read(errors_, bytes.data(), bytes.size());
  if (count > 0) {
    last_words_.append(bytes.data(), static_cast<std::size_t>(count));
    if (last_words_.size() > most_last_words) last_words_.erase(0, last_words_.size() - most_last_words);
  } else if (count == 0) {
    close(std::exchange(errors_, -1));  // poll() passes over it
  }
}

void FormatProgram::say(std::string_view line) {
  std::string all(line);
  all += '\n';
  for (std::size_t said = 0; said < all.size();) {
    const ssize_t count = send(input_, all.data() + said, all.size() - said, MSG_NOSIGNAL);
    if (count >= 0)
      said += static_cast<std::size_t>(count);
    else if (errno == EAGAIN)
      wait(For::input);
    else if (errno == EPIPE || errno == ECONNRESET)
      fail_as_ended();
    else if (errno != EINTR)
      throw world_error("cannot write to it", program_, errno);
  }
}

std::size_t FormatProgram::write(const std::byte* bytes, std::size_t size) {
  for (std::size_t sent = 0; sent < size;) {
    const ssize_t count = send(input_, bytes + sent, size - sent, MSG_NOSIGNAL);
    bool has_ended = false;
    if (count >= 0)
      sent += static_cast<std::size_t>(count);
    else if (errno == EAGAIN)
      has_ended = wait(For::either) && !listen();
    else if (errno == EPIPE || errno == ECONNRESET)
      while (!has_line() && !has_ended) has_ended = !listen();
    else if (errno != EINTR)
      throw world_error("cannot write to it", program_, errno);
    if (count < 0 && has_line()) return sent;
    if (has_ended) fail_as_ended();
  }
  return size;
}

bool FormatProgram::listen() {
  if (heard_.size() > limits_.line) fail(fmt::format("gave an answer of more than {} bytes", limits_.line));
  std::array<std::byte, 16384> bytes;
  const std::size_t count = read_some(bytes.data(), bytes.size());
  heard_.append(reinterpret_cast<const char*>(bytes.data()), count);
  return count > 0;
}

std::size_t FormatProgram::read_some(std::byte* out, std::size_t size) {
  for (;;) {
    wait(For::output);
    const ssize_t count = ::read(output_, out, size);
    if (count >= 0) return static_cast<std::size_t>(count);
    if (errno != EINTR && errno != EAGAIN) throw world_error("cannot read from it", program_, errno);
  }
}

std::string FormatProgram::hear() {
  std::size_t searched = 0;
  for (;;) {
    const std::size_t end = heard_.find('\n', searched);
    if (end != heard_.npos) {
      std::string line = heard_.substr(0, end);
      heard_.erase(0, end + 1);
      return line;
    }
    searched = heard_.size();
    if (!listen()) fail_as_ended();
  }
}

void FormatProgram::read(std::byte* out, std::size_t size) {
  const std::size_t known = std::min(size, heard_.size());
  if (known > 0) std::memcpy(out, heard_.data(), known);
  heard_.erase(0, known);
  for (std::size_t done = known; done < size;) {
    const std::size_t count = read_some(out + done, size - done);
    if (count == 0) fail_as_ended();
    done += count;
  }
}

void FormatProgram::finish() {
  shutdown(input_, SHUT_WR);
  std::byte more;
  if (!heard_.empty() || read_some(&more, 1) > 0) fail("sent unexpected output");
  const Ending how = ending();
  if (how.kind != Ending::Kind::exit || how.number != 0) fail(in_words(how));
}

FormatProgram::Ending FormatProgram::ending() {
  siginfo_t status = {};
  for (auto waited = 0ms; waited < 2s; waited += 10ms) {
    if (waitid(P_PID, static_cast<id_t>(process_), &status, WEXITED | WNOHANG | WNOWAIT) != 0 ||
        status.si_pid != 0)
      break;
    std::this_thread::sleep_for(10ms);
  }
  if (status.si_pid == 0) return {};
  return {status.si_code == CLD_EXITED ? Ending::Kind::exit : Ending::Kind::signal, status.si_status};
}

std::string FormatProgram::in_words(const Ending& ending) {
  switch (ending.kind) {
    case Ending::Kind::none:
      break;
    case Ending::Kind::exit:
      return fmt::format("exited with code {}", ending.number);
    case Ending::Kind::signal:
      return fmt::format("was ended by signal {} ({})", ending.number, strsignal(ending.number));
  }
  return "closed its output but did not exit";
}

void FormatProgram::fail_as_ended() {
  const Ending how = ending();
  // Of a library that trusts what it reads. Others may send any other signal.
  constexpr std::array of_crashes = {SIGSEGV, SIGBUS, SIGFPE, SIGILL};
  const bool is_reading = !file_.empty() && is_reader_, is_signal = how.kind == Ending::Kind::signal;
  const bool crashed = is_signal && std::ranges::find(of_crashes, how.number) != of_crashes.end();
  fail(fmt::format("{} before it answered{}", in_words(how),
                   is_reading && is_signal ? "; the file may be damaged" : ""),
       true, is_reading && crashed);
}

void FormatProgram::fail(std::string_view what, bool may_lack_memory, bool by_input) {
  for (int i = 0; i < 64 && errors_ >= 0; ++i) {
    pollfd ready = {errors_, POLLIN, 0};
    if (poll(&ready, 1, 0) <= 0) break;
    listen_to_errors();
  }
  while (last_words_.ends_with('\n')) last_words_.pop_back();
  std::string message = fmt::format("{}{}{}: {}", file_, file_.empty() ? "" : ": ", program_, what);
  if (!last_words_.empty()) message += fmt::format("; stderr: {}", last_words_);
  ErrorDetail detail;
  if (may_lack_memory && has_first_memory_ && limits_.memory < most_first_memory) {
    message += fmt::format("; it may have exceeded its limit of {} MiB", limits_.memory >> 20);
    detail.problem = Problem::program_memory;
  }
  if (by_input) throw BrokenInput(message, detail);
  throw WorldError(message, detail);
}

void FormatProgram::fail_for_memory(const std::string& message) const {
  if (!has_first_memory_) throw WorldError(message);  // it has what it asked for
  const std::string with_limit = fmt::format("{} ({} MiB)", message, limits_.memory >> 20);
  if (limits_.memory < most_first_memory) throw UsageError(with_limit, Problem::program_memory);
  throw WorldError(with_limit);
}

void FormatProgram::end() {
  for (int* end : {&input_, &output_, &errors_})
    if (*end >= 0) close(std::exchange(*end, -1));
  if (process_ < 0) return;
  // Its end of input asks it to end. The group lives as long as its leader is not waited for.
  ending();
  kill(-process_, SIGKILL);
  uninterrupted([&] { return waitpid(process_, nullptr, 0); });
  process_ = -1;
}

}  // namespace tagrid
