// Runs programs: arguments, standard streams, exit code or signal.
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace tagrid {

/// How a program ended, and what it printed.
struct Ending {
  int code = -1;   ///< -1 if a signal ended it
  int signal = 0;  ///< SIGKILL if it took too long
  std::string out, err;
  std::size_t peak_bytes = 0;  ///< peak of its memory
  double seconds = 0;          ///< its running time
  double cpu_seconds = 0;      ///< of processors; other programs on the machine do not change it
};

/// A program that runs. Its standard streams are pipes; the output can be a terminal.
class Process {
 public:
  enum class Output { pipe, terminal };

  Process(const std::vector<std::string>& arguments, const std::string& folder,
          Output output = Output::pipe) {
    const auto [in_read, in_write] = make_pipe();
    const auto [err_read, err_write] = make_pipe();
    const auto [out_read, out_write] = output == Output::pipe ? make_pipe() : make_terminal();
    pid_ = fork();
    if (pid_ == 0) run_child(arguments, folder, in_read, out_write, err_write);
    for (const int end : {in_read, out_write, err_write}) close(end);
    in_ = in_write;
    out_ = out_read;
    err_ = err_read;
  }
  ~Process() {
    if (pid_ > 0) finish();
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  /// Writes to its standard input, and leaves that open. REQUIRES: less than a pipe holds, 64 KiB.
  void feed(std::string_view bytes) {
    if (::write(in_, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size()))
      throw std::runtime_error("the process does not read");
  }
  void send(int signal) { kill(pid_, signal); }

  /// Waits for the end with the standard input open, no longer than three minutes. REQUIRES: little output.
  Ending wait() {
    for (int i = 0; i < 18000; ++i) {
      siginfo_t info = {};
      if (waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
          info.si_pid == pid_)
        return finish();
      usleep(10000);
    }
    kill(pid_, SIGKILL);
    return finish();
  }
  /// Writes `input` and closes the standard input; waits for the end, no longer than ten minutes: a machine that is busy
  /// with other work is no reason to fail.
  Ending finish(std::string_view input = {}) {
    Ending ending;
    // A program may end before it has read everything.
    ::signal(SIGPIPE, SIG_IGN);
    if (input.empty()) close_input();
    const auto limit = std::chrono::steady_clock::now() + std::chrono::minutes(10);
    while (out_ >= 0 || err_ >= 0 || in_ >= 0) {
      if (std::chrono::steady_clock::now() > limit) kill(pid_, SIGKILL);
      exchange(input, ending);
    }
    int status = 0;
    rusage usage = {};
    wait4(pid_, &status, 0, &usage);
    pid_ = -1;
    ending.peak_bytes = static_cast<std::size_t>(usage.ru_maxrss) * 1024;
    for (const timeval& time : {usage.ru_utime, usage.ru_stime})
      ending.cpu_seconds += static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin_;
    ending.seconds = took.count();
    if (WIFEXITED(status)) ending.code = WEXITSTATUS(status);
    if (WIFSIGNALED(status)) ending.signal = WTERMSIG(status);
    return ending;
  }

 private:
  using Ends = std::pair<int, int>;

  static Ends make_pipe() {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
    return {ends[0], ends[1]};
  }
  static Ends make_terminal() {
    const int master = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (master < 0 || grantpt(master) != 0 || unlockpt(master) != 0) throw std::runtime_error("no terminal");
    return {master, open(ptsname(master), O_RDWR | O_NOCTTY | O_CLOEXEC)};
  }
  [[noreturn]] static void run_child(const std::vector<std::string>& arguments, const std::string& folder,
                                     int in, int out, int err) {
    dup2(in, STDIN_FILENO);
    dup2(out, STDOUT_FILENO);
    dup2(err, STDERR_FILENO);
    ::signal(SIGPIPE, SIG_DFL);
    std::vector<char*> argv;
    for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
    argv.push_back(nullptr);
    if (chdir(folder.c_str()) == 0) execvp(argv[0], argv.data());
    _exit(127);
  }
  void close_input() {
    if (in_ >= 0) close(in_);
    in_ = -1;
  }
  static void take(int& from, std::string& to) {
    std::array<char, 65536> bytes;
    const ssize_t count = read(from, bytes.data(), bytes.size());
    if (count > 0) {
      to.append(bytes.data(), static_cast<std::size_t>(count));
    } else {
      close(from);
      from = -1;
    }
  }
  void exchange(std::string_view& input, Ending& ending) {
    std::array<pollfd, 3> ends = {pollfd{in_, POLLOUT, 0}, pollfd{out_, POLLIN, 0}, pollfd{err_, POLLIN, 0}};
    poll(ends.data(), ends.size(), 1000);
    if (ends[0].revents != 0) {
      const ssize_t count = ::write(in_, input.data(), std::min<std::size_t>(input.size(), 4096));
      if (count > 0) input.remove_prefix(static_cast<std::size_t>(count));
      if (count < 0 || input.empty()) close_input();
    }
    if (ends[1].revents != 0) take(out_, ending.out);
    if (ends[2].revents != 0) take(err_, ending.err);
  }

  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  pid_t pid_ = -1;
  int in_ = -1, out_ = -1, err_ = -1;
};

}  // namespace tagrid
