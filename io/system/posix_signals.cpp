#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/signalfd.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>

#include "io/errors/errors.h"
#include "io/system/files.h"
#include "io/system/signals.h"

namespace tagrid {
namespace {

int remove_files_in(int folder, int depth) noexcept;

/// More than any directory of ours has within it.
constexpr int deepest_in_handler = 16;

/// Removes a file, or a directory with all that is in it.
bool remove_entry(int folder, const char* name, int depth) noexcept {
  if (unlinkat(folder, name, 0) == 0) return true;
  if (errno != EISDIR || depth == deepest_in_handler || std::strcmp(name, ".") == 0 ||
      std::strcmp(name, "..") == 0)
    return false;
  const int inner = openat(folder, name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (inner >= 0) {
    while (remove_files_in(inner, depth + 1) > 0) {
    }
    close(inner);
  }
  return unlinkat(folder, name, AT_REMOVEDIR) == 0;
}

// Reads the directory once and removes its files and directories; returns how many. It does not use
// readdir(), which allocates: a signal handler must not.
int remove_files_in(int folder, int depth) noexcept {
  alignas(8) char entries[4096];
  int removed = 0;
  lseek(folder, 0, SEEK_SET);
  for (;;) {
    const long size = syscall(SYS_getdents64, folder, entries, sizeof entries);
    if (size <= 0) return removed;
    for (long at = 0; at < size;) {
      // The layout of the kernel: number, offset, length of the entry, type, name.
      unsigned short length;
      std::memcpy(&length, entries + at + 16, sizeof length);
      removed += remove_entry(folder, entries + at + 19, depth);
      at += length;
    }
  }
}

}  // namespace

void catch_end_signals(void (*handler)(int)) {
  struct sigaction action = {};
  action.sa_handler = handler;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigemptyset(&action.sa_mask);
  for (const int number : {SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGPIPE, SIGXCPU}) {
    struct sigaction before;
    if (sigaction(number, nullptr, &before) == 0 && before.sa_handler != SIG_IGN)
      sigaction(number, &action, nullptr);
  }
  signal(SIGXFSZ, SIG_IGN);
}

void in_handler::rename(const char* from, const char* to) noexcept { std::rename(from, to); }
void in_handler::unlink(const char* path) noexcept { ::unlink(path); }
void in_handler::remove_folder(const char* path) noexcept { rmdir(path); }

void in_handler::remove_with_files(const char* path) noexcept {
  const int folder = open(path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (folder >= 0) {
    while (remove_files_in(folder, 0) > 0) {
    }
    close(folder);
  }
  rmdir(path);
}

void in_handler::say(const char* text, std::size_t size) noexcept {
  if (write(STDERR_FILENO, text, size) < 0) return;
}

void in_handler::exit(int code) noexcept { _exit(code); }

void in_handler::end_by(int number) noexcept {
  signal(number, SIG_DFL);
  raise(number);
}

struct EndSignals::Kept {
  sigset_t set, before;
  Descriptor descriptor;
};

EndSignals::EndSignals() : kept_(std::make_unique<Kept>()) {
  sigemptyset(&kept_->set);
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&kept_->set, number);
  if (pthread_sigmask(SIG_BLOCK, &kept_->set, &kept_->before) == 0)
    kept_->descriptor = signalfd(-1, &kept_->set, SFD_CLOEXEC);
  if (kept_->descriptor < 0) throw WorldError("signals cannot be waited for: {}", std::strerror(errno));
}

EndSignals::~EndSignals() = default;

int EndSignals::descriptor() const { return kept_->descriptor; }

void EndSignals::let_through() {
  signalfd_siginfo first;
  [[maybe_unused]] const auto taken = read(kept_->descriptor, &first, sizeof first);
  pthread_sigmask(SIG_SETMASK, &kept_->before, nullptr);
}

std::string EndSignals::open_in_browser(const std::string& address) const {
  std::string program = "xdg-open", text = address;
  std::array<char*, 3> arguments = {program.data(), text.data(), nullptr};
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_t actions;
  posix_spawnattr_init(&attributes);
  // Without standard streams, and in a separate group: a signal that ends this program does not end the browser.
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETPGROUP);
  posix_spawnattr_setsigmask(&attributes, &kept_->before);
  posix_spawn_file_actions_init(&actions);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&actions, stream, "/dev/null", O_RDWR, 0);
  pid_t process = 0;
  const int error = posix_spawnp(&process, program.c_str(), &actions, &attributes, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  return error == 0 ? "" : "xdg-open is missing";
}

}  // namespace tagrid
