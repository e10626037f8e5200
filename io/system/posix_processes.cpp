#include <fcntl.h>
#include <fmt/format.h>
#include <linux/close_range.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
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

void limit_own_memory(rlim_t memory) {
  // Memory of its own: not the code of libraries, nor files that are mapped. Only the soft limit, as a
  // description may ask for more.
  rlimit limit;
  if (!limits_memory || getrlimit(RLIMIT_DATA, &limit) != 0) return;
  limit.rlim_cur = std::min(memory, limit.rlim_max);
  setrlimit(RLIMIT_DATA, &limit);
}

// The streams of a program that is started, and their other ends.
struct Streams {
  // The input is a socket, as writing to it can fail without a signal, and as it can carry files.
  Ends input, output, errors;

  bool open() {
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, input.data()) != 0 ||
        pipe2(output.data(), O_CLOEXEC) != 0 || pipe2(errors.data(), O_CLOEXEC) != 0)
      return false;
    // A program that reads ahead is stopped less often. It is no harm if the system does not allow it.
    fcntl(output[1], F_SETPIPE_SZ, 1 << 20);
    return true;
  }
  // Our ends.
  Child child(pid_t process) {
    for (const int end : {input[0], output[0], errors[0]}) fcntl(end, F_SETFL, O_NONBLOCK);
    return {process, input.take(0), output.take(0), errors.take(0)};
  }
};

// Room for the message that carries files over a socket.
union FilesInMessage {
  cmsghdr head;
  char bytes[CMSG_SPACE(3 * sizeof(int))];
};

// In the child, between fork() and exec(): only calls that are safe there.
[[noreturn]] void become(char* const* arguments, char* const* variables, int input, int output, int errors,
                         int report, pid_t parent, rlim_t memory) {
  setpgid(0, 0);
  limit_own_memory(memory);
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
    Streams streams;
    Ends report;
    if (!streams.open() || pipe2(report.data(), O_CLOEXEC) != 0) return {Failure::pipe, errno};
    std::vector<std::string> names = {program};
    const std::vector<char*> arguments = pointers(names), variables = pointers(environment);
    const pid_t parent = getpid(), process = fork();
    if (process < 0) return {Failure::process, errno};
    if (process == 0)
      become(arguments.data(), variables.data(), streams.input[1], streams.output[1], streams.errors[1],
             report[1], parent, memory);
    setpgid(process, process);  // whoever is first
    for (Ends* ends : {&streams.input, &streams.output, &streams.errors, &report}) ends->drop(1);
    int why = 0;
    if (uninterrupted([&] { return read(report[0], &why, sizeof why); }) > 0) {
      kill(process);
      return {Failure::program, why};
    }
    return {Failure::none, 0, streams.child(process)};
  }

  StartedChild ask_for_twin(const Child& program, std::string_view request) override {
    using Failure = StartedChild::Failure;
    Streams streams;
    if (!streams.open()) return {Failure::pipe, errno};
    const std::array theirs = {streams.input[1], streams.output[1], streams.errors[1]};
    FilesInMessage files = {};
    files.head = {.cmsg_len = CMSG_LEN(sizeof theirs), .cmsg_level = SOL_SOCKET, .cmsg_type = SCM_RIGHTS};
    iovec bytes = {const_cast<char*>(request.data()), request.size()};
    msghdr message = {};
    message.msg_iov = &bytes;
    message.msg_iovlen = 1;
    message.msg_control = &files;
    message.msg_controllen = sizeof files.bytes;
    std::memcpy(CMSG_DATA(CMSG_FIRSTHDR(&message)), theirs.data(), sizeof theirs);
    const ssize_t sent = uninterrupted([&] { return sendmsg(program.input, &message, MSG_NOSIGNAL); });
    // A request is short, and its reader waits for it.
    if (sent != static_cast<ssize_t>(request.size())) return {Failure::process, sent < 0 ? errno : EIO};
    return {Failure::none, 0, streams.child(-1)};
  }

  bool take_twin(int process, std::uint64_t memory) override {
    siginfo_t status = {};
    if (waitid(P_PID, static_cast<id_t>(process), &status, WEXITED | WNOHANG | WNOWAIT) != 0) return false;
    setpgid(process, process);  // whoever is first
    rlimit limit;
    if (!limits_memory || prlimit(process, RLIMIT_DATA, nullptr, &limit) != 0) return true;
    limit.rlim_cur = std::min<rlim_t>(memory, limit.rlim_max);
    prlimit(process, RLIMIT_DATA, &limit, nullptr);
    return true;
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
    for (auto waited = 0ms, step = 1ms; waited < most; waited += step, step = std::min(2 * step, 10ms)) {
      if (waitid(P_PID, static_cast<id_t>(process), &status, WEXITED | WNOHANG | WNOWAIT) != 0 ||
          status.si_pid != 0)
        break;
      std::this_thread::sleep_for(step);
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

}  // namespace

Processes& processes_of_system() {
  static Processes& all = *new SystemProcesses;
  return all;
}

std::string_view end_of_program_names() { return ""; }
char separator_of_folders() { return ':'; }

std::string name_of_signal(int number) { return strsignal(number); }

std::ptrdiff_t send_bytes(int socket, std::span<const std::byte> bytes) {
  return uninterrupted([&] { return send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL); });
}

void end_sending(int socket) { shutdown(socket, SHUT_WR); }

std::ptrdiff_t receive_request(std::span<char> to, TwinStreams& streams) {
  FilesInMessage files = {};
  iovec bytes = {to.data(), to.size()};
  msghdr message = {};
  message.msg_iov = &bytes;
  message.msg_iovlen = 1;
  message.msg_control = &files;
  message.msg_controllen = sizeof files.bytes;
  const ssize_t count = uninterrupted([&] { return recvmsg(STDIN_FILENO, &message, MSG_CMSG_CLOEXEC); });
  // Somebody who tries a reader gives it a pipe or a file; and the sandbox has no such call.
  if (count < 0 && (errno == ENOTSOCK || errno == ENOSYS))
    return uninterrupted([&] { return read(STDIN_FILENO, to.data(), to.size()); });
  const cmsghdr* head = count < 0 ? nullptr : CMSG_FIRSTHDR(&message);
  if (head == nullptr || head->cmsg_level != SOL_SOCKET || head->cmsg_type != SCM_RIGHTS) return count;
  std::array<int, 3> received = {-1, -1, -1};
  std::memcpy(received.data(), CMSG_DATA(head), std::min(head->cmsg_len - CMSG_LEN(0), sizeof received));
  streams = {received[0], received[1], received[2]};
  return count;
}

bool can_start_twins() { return true; }

int start_twin(const TwinStreams& streams, std::FILE* answers) {
#ifdef TAGRID_SANITIZED
  errno = ENOSYS;  // their threads and locks would not survive
  return -1;
#endif
  const pid_t parent = getppid();
  // A brother, not a child: the process that talks to both waits for both. fork() cannot make one. What fork() does
  // besides is needed only if there are several threads.
  constexpr long flags = CLONE_PARENT | SIGCHLD;
#ifdef __s390__
  const long process = syscall(SYS_clone, nullptr, flags, nullptr, nullptr, 0L);
#else
  const long process = syscall(SYS_clone, flags, nullptr, nullptr, nullptr, 0L);
#endif
  if (process != 0) return static_cast<int>(process);
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(127);  // it died before the line above
  if (dup2(streams.input, STDIN_FILENO) < 0 || dup2(streams.output, fileno(answers)) < 0 ||
      dup2(streams.errors, STDOUT_FILENO) < 0 || dup2(streams.errors, STDERR_FILENO) < 0)
    _exit(127);
  return 0;
}

}  // namespace tagrid
