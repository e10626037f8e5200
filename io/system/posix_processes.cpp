#include <fcntl.h>
#include <fmt/format.h>
#include <linux/close_range.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <thread>

#include "io/system/processes.h"

namespace tagrid {
namespace {

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

class SystemProcesses final : public Processes {
 public:
  StartedChild start(const std::string& program, std::vector<std::string> environment,
                     std::uint64_t memory) override {
    using Failure = StartedChild::Failure;
    // The input is a socket, as writing to it can fail without a signal.
    Ends input, output, errors, report;
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, input.data()) != 0 ||
        pipe2(output.data(), O_CLOEXEC) != 0 || pipe2(errors.data(), O_CLOEXEC) != 0 ||
        pipe2(report.data(), O_CLOEXEC) != 0)
      return {Failure::pipe, errno};
    // A program that reads ahead is stopped less often. It is no harm if the system does not allow it.
    fcntl(output[1], F_SETPIPE_SZ, 1 << 20);
    std::vector<std::string> names = {program};
    const std::vector<char*> arguments = pointers(names), variables = pointers(environment);
    const pid_t parent = getpid(), process = fork();
    if (process < 0) return {Failure::process, errno};
    if (process == 0)
      become(arguments.data(), variables.data(), input[1], output[1], errors[1], report[1], parent, memory);
    setpgid(process, process);  // whoever is first
    input.drop(1);
    output.drop(1);
    errors.drop(1);
    report.drop(1);
    int why = 0;
    if (uninterrupted([&] { return read(report[0], &why, sizeof why); }) > 0) {
      kill(process);
      return {Failure::program, why};
    }
    for (const int end : {input[0], output[0], errors[0]}) fcntl(end, F_SETFL, O_NONBLOCK);
    return {Failure::none, 0, {process, input.take(0), output.take(0), errors.take(0)}};
  }

  int limit_memory(int process, std::uint64_t bytes) override {
    rlimit limit;
    if (!limits_memory || prlimit(process, RLIMIT_DATA, nullptr, &limit) != 0) return 0;
    limit.rlim_cur = std::min<rlim_t>(bytes + untouched_memory(process), limit.rlim_max);
    return prlimit(process, RLIMIT_DATA, &limit, nullptr) != 0 && errno != ESRCH ? errno : 0;
  }

  ChildEnding ending(int process, std::chrono::milliseconds most) override {
    using namespace std::chrono_literals;
    siginfo_t status = {};
    for (auto waited = 0ms; waited < most; waited += 10ms) {
      if (waitid(P_PID, static_cast<id_t>(process), &status, WEXITED | WNOHANG | WNOWAIT) != 0 ||
          status.si_pid != 0)
        break;
      std::this_thread::sleep_for(10ms);
    }
    if (status.si_pid == 0) return {};
    if (status.si_code == CLD_EXITED) return {ChildEnding::Kind::exit, status.si_status};
    constexpr std::array of_crashes = {SIGSEGV, SIGBUS, SIGFPE, SIGILL};
    return {ChildEnding::Kind::signal, status.si_status,
            std::ranges::find(of_crashes, status.si_status) != of_crashes.end()};
  }

  void kill(int process) override {
    // The group lives as long as its leader is not waited for.
    ::kill(-process, SIGKILL);
    uninterrupted([&] { return waitpid(process, nullptr, 0); });
  }
};

Processes* processes_instead = nullptr;

}  // namespace

Processes& processes_of_system() {
  static Processes& all = *new SystemProcesses;
  return all;
}

Processes& processes() { return processes_instead != nullptr ? *processes_instead : processes_of_system(); }

ProcessesInstead::ProcessesInstead(Processes& processes)
    : before_(std::exchange(processes_instead, &processes)) {}
ProcessesInstead::~ProcessesInstead() { processes_instead = before_; }

std::string name_of_signal(int number) { return strsignal(number); }

std::ptrdiff_t send_bytes(int socket, std::span<const std::byte> bytes) {
  return uninterrupted([&] { return send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL); });
}

void end_sending(int socket) { shutdown(socket, SHUT_WR); }

}  // namespace tagrid
