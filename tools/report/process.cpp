#include "tools/report/process.h"

#include <fcntl.h>
#include <malloc.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "io/errors/errors.h"
#include "io/files/temporaries.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

constexpr std::string_view clear_line = "\r\033[K";
std::mutex terminal;  ///< of the two that follow, and of what is written
std::string status;   ///< what the last line shows
std::atomic<bool> status_is_shown{false};

void write_to_terminal(std::string_view text) {
  if (std::fwrite(text.data(), 1, text.size(), stderr) < text.size()) std::clearerr(stderr);
}

/// `text` without what does not fit on a line: a line that wraps cannot be cleared.
std::string_view on_one_line(std::string_view text) {
  const std::size_t most = columns_of_terminal();
  std::size_t columns = 0;
  for (std::size_t i = 0; i < text.size(); ++i)
    if ((static_cast<unsigned char>(text[i]) & 0xC0) != 0x80 && ++columns == most) return text.substr(0, i);
  return text;
}

void end_by_signal(int number) {
  if (signal_waits(number)) return;
  unlink_temporaries();
  if (status_is_shown && write(STDERR_FILENO, clear_line.data(), clear_line.size()) < 0) return;
  if (code_after_signal() >= 0) {
    write_message_after_signal();
    _exit(code_after_signal());
  }
  // The handler was removed when it was called (SA_RESETHAND), so this ends the process when it returns.
  raise(number);
}

// The heap grows at once, in large pages. The system gives pages when they are first written, one at a time:
// of 4 KiB, that takes a seventh of an encoding, and more than that on virtual machines. Pages that are never
// written take no memory. malloc() itself can be told to do this only from outside of the program
// (GLIBC_TUNABLES), and mallopt() knows no large pages. So the heap is made to grow, and marked up to its
// end, which sbrk(0) is. See docs/decisions/0037-large-pages.md.
void grow_heap_in_large_pages() {
  constexpr std::size_t block = std::size_t{1} << 24, blocks = 7;  // less than is given back when it is freed
  std::array<void*, blocks> all;
  for (void*& one : all) one = std::malloc(block);
  const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  if (const auto first = reinterpret_cast<std::uintptr_t>(all.front()); all.front() != nullptr) {
    const std::uintptr_t begin = (first + page - 1) / page * page,
                         end = reinterpret_cast<std::uintptr_t>(sbrk(0));
    if (begin < end) madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
  }
  for (void* one : all) std::free(one);
}

}  // namespace

void occupy_standard_streams() {
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(descriptor, F_GETFD) != -1 || errno != EBADF) continue;
    // The lowest free descriptor is this one. It is opened in the wrong mode, so that using it fails.
    if (open("/dev/null", descriptor == STDIN_FILENO ? O_WRONLY : O_RDONLY) < 0) return;
  }
}

void catch_signals() {
  struct sigaction action = {};
  action.sa_handler = end_by_signal;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigemptyset(&action.sa_mask);
  for (const int number : {SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGPIPE, SIGXCPU}) {
    struct sigaction before;
    if (sigaction(number, nullptr, &before) == 0 && before.sa_handler != SIG_IGN)
      sigaction(number, &action, nullptr);
  }
  std::signal(SIGXFSZ, SIG_IGN);
}

void keep_freed_memory() {
  // Every brick uses the memory that the one before it freed; only blocks as large as a layer go back to the
  // system at once. There is one heap: a heap per thread, as is usual, fragments with every layer, and
  // allocations are not frequent enough for threads to wait for each other.
  mallopt(M_MMAP_THRESHOLD, 1 << 25);
  mallopt(M_TRIM_THRESHOLD, 1 << 27);
  mallopt(M_ARENA_MAX, 1);
  grow_heap_in_large_pages();
}

void give_back_freed_memory(std::uint64_t limit) {
  // Free blocks below the first size may lie between blocks that are in use.
  const auto part = [&](std::uint64_t of_limit, std::uint64_t least, std::uint64_t most) {
    return static_cast<int>(std::clamp(limit / of_limit, least, most));
  };
  mallopt(M_MMAP_THRESHOLD, part(64, 1 << 17, 1 << 25));
  mallopt(M_TRIM_THRESHOLD, part(16, 1 << 20, 1 << 27));
  malloc_trim(0);
  // A large page is taken whole, even if a few bytes of it are needed.
  prctl(PR_SET_THP_DISABLE, 1, 0, 0, 0);
}

std::uint64_t peak_memory() {
  // getrusage() also counts the process that started this one.
  std::ifstream numbers("/proc/self/status");
  for (std::string word; numbers >> word;)
    if (std::uint64_t kibibytes; word == "VmHWM:" && numbers >> kibibytes) return kibibytes * 1024;
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

double processor_seconds() {
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

namespace {

// Texts with secrets, and what is shown in place of them.
std::vector<std::pair<std::string, std::string>>& secrets() {
  static std::vector<std::pair<std::string, std::string>> all;
  return all;
}

std::string without_secrets(std::string_view text) {
  std::string shown_text(text);
  for (const auto& [secret, shown] : secrets())
    for (std::size_t at = 0; (at = shown_text.find(secret, at)) != shown_text.npos; at += shown.size())
      shown_text.replace(at, secret.size(), shown);
  return shown_text;
}

}  // namespace

void show_instead_of(const std::string& text, const std::string& shown) {
  if (!text.empty() && text != shown) secrets().emplace_back(text, shown);
}

void say_line(std::string_view text) {
  const std::lock_guard lock(terminal);
  std::string line = printable(without_secrets(text)) + "\n";
  if (!status.empty()) line = std::string(clear_line) + line + status;
  write_to_terminal(line);
}

std::size_t columns_of_terminal() {
  winsize size = {};
  return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0 ? std::string::npos : size.ws_col;
}

void show_status(std::string_view text) {
  const std::lock_guard lock(terminal);
  const std::string shown = printable(without_secrets(text));
  status = on_one_line(shown);
  status_is_shown = !status.empty();
  write_to_terminal(std::string(clear_line) + status);
  std::fflush(stderr);
}

void flush_standard_output() {
  if (std::fflush(stdout) == 0 && !std::ferror(stdout)) return;
  if (errno == EPIPE) throw ClosedPipe("standard output: the reader closed the pipe");
  throw world_error("cannot write", "standard output", errno);
}

}  // namespace tagrid
