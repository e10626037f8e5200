// A failing disk, to be preloaded into a program: it counts calls that touch files of one directory, and
// makes one of them, or all, fail. Environment variables control it:
//
//   TAGRID_FAULT_FOLDER   the directory; the paths below it are the ones that count
//   TAGRID_FAULT_STREAMS  if set: the standard input and output count as well, whatever they are
//   TAGRID_FAULT_LOG      a file: a line "name path" for every call that counts; not below the folder
//   TAGRID_FAULT_AT       the number of the call that fails, from 1; 0: all of them
//   TAGRID_FAULT_KIND     a number: that errno. "short": a read or write is of fewer bytes than it could be.
//                         "EINTR": the call is interrupted once, as by a signal; the next one is not.
//                         "SIGKILL", "SIGTERM", "SIGINT", "SIGSTOP": the signal comes just before the call
//   TAGRID_FAULT_LASTING  if set: later calls of the same name fail too, as on a disk that stays full
//
//   TAGRID_FAULT_THREAD   number, from 1, of the first thread that cannot be made, nor any after it; no
//   directory
//
// A close() that fails has closed the file anyway, as on Linux.
#include <dlfcn.h>
#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <utility>

namespace {

const char* setting(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr && *value != '\0' ? value : nullptr;
}

struct Plan {
  std::string folder;
  bool streams = false, lasting = false;
  long at = -1;
  int error = 0;
  bool is_short = false, interrupts = false;
  int signal = 0;
  int log = -1;

  Plan() {
    if (const char* value = setting("TAGRID_FAULT_FOLDER")) folder = value;
    if (const char* value = setting("TAGRID_FAULT_AT")) at = std::atol(value);
    streams = setting("TAGRID_FAULT_STREAMS") != nullptr;
    lasting = setting("TAGRID_FAULT_LASTING") != nullptr;
    const std::string kind = setting("TAGRID_FAULT_KIND") ? setting("TAGRID_FAULT_KIND") : "0";
    is_short = kind == "short";
    interrupts = kind == "EINTR";
    error = interrupts ? EINTR : std::atoi(kind.c_str());
    for (const auto& [name, number] :
         {std::pair("SIGKILL", SIGKILL), {"SIGTERM", SIGTERM}, {"SIGINT", SIGINT}, {"SIGSTOP", SIGSTOP}})
      if (kind == name) signal = number;
    // This function's own calls bypass the functions below.
    if (const char* value = setting("TAGRID_FAULT_LOG"))
      log = static_cast<int>(
          syscall(SYS_openat, AT_FDCWD, value, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600));
  }
};

const Plan& plan() {
  static const Plan the_plan;
  return the_plan;
}

std::atomic<long> calls{0};
std::atomic<bool> interrupted_before{false};
std::atomic<const char*> failed_name{nullptr};

// The path of an open file, as the kernel knows it.
std::string path_of(int descriptor) {
  const std::string link = "/proc/self/fd/" + std::to_string(descriptor);
  char target[PATH_MAX];
  const long length = syscall(SYS_readlinkat, AT_FDCWD, link.c_str(), target, sizeof target);
  return length > 0 ? std::string(target, static_cast<std::size_t>(length)) : std::string();
}

std::string absolute(const char* path) {
  if (path[0] == '/') return path;
  char folder[PATH_MAX];
  return getcwd(folder, sizeof folder) != nullptr ? std::string(folder) + "/" + path : path;
}

enum class Fault { none, error, fewer_bytes };

// Counts a call of `name`; returns the fault for it.
Fault next_fault(const char* name, const std::string& path, bool counts, bool transfers,
                 bool can_be_interrupted) {
  const Plan& p = plan();
  if (p.folder.empty() || !counts) return Fault::none;
  const long number = ++calls;
  if (p.log >= 0) {
    const std::string line = std::string(name) + " " + path + "\n";
    syscall(SYS_write, p.log, line.data(), line.size());
  }
  const char* const failed = failed_name.load();
  const bool again = p.lasting && failed != nullptr && std::strcmp(failed, name) == 0;
  if (p.at != 0 && number != p.at && !again) return Fault::none;
  if (p.signal != 0) raise(p.signal);
  if (p.is_short) return transfers ? Fault::fewer_bytes : Fault::none;
  if (p.interrupts) {
    if (!can_be_interrupted) return Fault::none;
    // If all calls are interrupted, then only every second time: a repeated call must succeed eventually.
    if (interrupted_before.exchange(true)) {
      interrupted_before = false;
      return Fault::none;
    }
  }
  failed_name = name;
  return p.error != 0 ? Fault::error : Fault::none;
}

bool below_folder(const std::string& path) {
  return path == plan().folder || path.starts_with(plan().folder + "/");
}

Fault fault_of(const char* name, int descriptor, bool transfers = false, bool can_be_interrupted = true) {
  if (plan().folder.empty()) return Fault::none;
  const std::string path = path_of(descriptor);
  const bool stream = descriptor <= STDOUT_FILENO && plan().streams;
  return next_fault(name, path, stream || below_folder(path), transfers, can_be_interrupted);
}

Fault fault_of(const char* name, const char* path, bool can_be_interrupted = false) {
  if (plan().folder.empty()) return Fault::none;
  const std::string full = absolute(path);
  return next_fault(name, full, below_folder(full), false, can_be_interrupted);
}

int fail() {
  errno = plan().error;
  return -1;
}

std::size_t fewer(std::size_t size) { return std::min(size, 1 + size / 3); }

template <class Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

}  // namespace

// The original function `name`.
#define NEXT(name) static const auto original = next<decltype(&name)>(#name)

extern "C" {

#define OPEN(name)                                                                              \
  int name(const char* path, int flags, ...) {                                                  \
    va_list arguments;                                                                          \
    va_start(arguments, flags);                                                                 \
    const auto mode = va_arg(arguments, mode_t);                                                \
    va_end(arguments);                                                                          \
    NEXT(name);                                                                                 \
    const bool writes = (flags & O_ACCMODE) != O_RDONLY;                                        \
    if (fault_of(writes ? "open-to-write" : "open", path, true) == Fault::error) return fail(); \
    return original(path, flags, mode);                                                         \
  }
OPEN(open)
OPEN(open64)

#define MAKE_TEMPORARY(name)                                       \
  int name(char* path, int flags) {                                \
    NEXT(name);                                                    \
    if (fault_of("mkostemp", path) == Fault::error) return fail(); \
    return original(path, flags);                                  \
  }
MAKE_TEMPORARY(mkostemp)
MAKE_TEMPORARY(mkostemp64)

ssize_t read(int descriptor, void* bytes, size_t size) {
  NEXT(read);
  const Fault fault = fault_of("read", descriptor, true);
  if (fault == Fault::error) return fail();
  return original(descriptor, bytes, fault == Fault::fewer_bytes ? fewer(size) : size);
}

ssize_t write(int descriptor, const void* bytes, size_t size) {
  NEXT(write);
  const Fault fault = fault_of("write", descriptor, true);
  if (fault == Fault::error) return fail();
  return original(descriptor, bytes, fault == Fault::fewer_bytes ? fewer(size) : size);
}

#define TRANSFER_AT(function, name, pointer, position_type)                                         \
  ssize_t function(int descriptor, pointer bytes, size_t size, position_type position) {            \
    NEXT(function);                                                                                 \
    const Fault fault = fault_of(name, descriptor, true);                                           \
    if (fault == Fault::error) return fail();                                                       \
    return original(descriptor, bytes, fault == Fault::fewer_bytes ? fewer(size) : size, position); \
  }
TRANSFER_AT(pread, "pread", void*, off_t)
TRANSFER_AT(pread64, "pread", void*, off64_t)
TRANSFER_AT(pwrite, "pwrite", const void*, off_t)
TRANSFER_AT(pwrite64, "pwrite", const void*, off64_t)

int close(int descriptor) {
  NEXT(close);
  const bool fails = fault_of("close", descriptor) == Fault::error;
  const int result = original(descriptor);
  return fails ? fail() : result;
}

#define ON_DESCRIPTOR(name)                                         \
  int name(int descriptor) {                                        \
    NEXT(name);                                                     \
    if (fault_of(#name, descriptor) == Fault::error) return fail(); \
    return original(descriptor);                                    \
  }
ON_DESCRIPTOR(fsync)
ON_DESCRIPTOR(fdatasync)

int fchmod(int descriptor, mode_t mode) {
  NEXT(fchmod);
  if (fault_of("fchmod", descriptor, false, false) == Fault::error) return fail();
  return original(descriptor, mode);
}

int fchown(int descriptor, uid_t owner, gid_t group) {
  NEXT(fchown);
  if (fault_of("fchown", descriptor, false, false) == Fault::error) return fail();
  return original(descriptor, owner, group);
}

int futimens(int descriptor, const timespec times[2]) {
  NEXT(futimens);
  if (fault_of("futimens", descriptor, false, false) == Fault::error) return fail();
  return original(descriptor, times);
}

#define SEEK(name, position_type)                                                   \
  position_type name(int descriptor, position_type offset, int whence) {            \
    NEXT(name);                                                                     \
    if (fault_of("lseek", descriptor, false, false) == Fault::error) return fail(); \
    return original(descriptor, offset, whence);                                    \
  }
SEEK(lseek, off_t)
SEEK(lseek64, off64_t)

#define TRUNCATE(name, position_type)                                     \
  int name(int descriptor, position_type size) {                          \
    NEXT(name);                                                           \
    if (fault_of("ftruncate", descriptor) == Fault::error) return fail(); \
    return original(descriptor, size);                                    \
  }
TRUNCATE(ftruncate, off_t)
TRUNCATE(ftruncate64, off64_t)

#define STATUS(function, name, status_type)                      \
  int function(const char* path, status_type* status) noexcept { \
    NEXT(function);                                              \
    if (fault_of(name, path) == Fault::error) return fail();     \
    return original(path, status);                               \
  }
STATUS(stat, "stat", struct stat)
STATUS(stat64, "stat", struct stat64)
STATUS(lstat, "lstat", struct stat)
STATUS(lstat64, "lstat", struct stat64)

#define STATUS_OF_OPEN(function, status_type)                                       \
  int function(int descriptor, status_type* status) noexcept {                      \
    NEXT(function);                                                                 \
    if (fault_of("fstat", descriptor, false, false) == Fault::error) return fail(); \
    return original(descriptor, status);                                            \
  }
STATUS_OF_OPEN(fstat, struct stat)
STATUS_OF_OPEN(fstat64, struct stat64)

int rename(const char* from, const char* to) noexcept {
  NEXT(rename);
  if (fault_of("rename", to) == Fault::error) return fail();
  return original(from, to);
}

int renameat2(int from_folder, const char* from, int to_folder, const char* to, unsigned flags) noexcept {
  NEXT(renameat2);
  if (fault_of("rename", to) == Fault::error) return fail();
  return original(from_folder, from, to_folder, to, flags);
}

int link(const char* from, const char* to) noexcept {
  NEXT(link);
  if (fault_of("link", to) == Fault::error) return fail();
  return original(from, to);
}

int mkdir(const char* path, mode_t mode) noexcept {
  NEXT(mkdir);
  if (fault_of("mkdir", path) == Fault::error) return fail();
  return original(path, mode);
}

int rmdir(const char* path) noexcept {
  NEXT(rmdir);
  if (fault_of("rmdir", path) == Fault::error) return fail();
  return original(path);
}

int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*work)(void*),
                   void* argument) noexcept {
  NEXT(pthread_create);
  static std::atomic<long> threads{0};
  static const char* const last = setting("TAGRID_FAULT_THREAD");
  if (last != nullptr && ++threads >= std::atol(last)) return EAGAIN;
  return original(thread, attributes, work, argument);
}

int unlink(const char* path) noexcept {
  NEXT(unlink);
  if (fault_of("unlink", path) == Fault::error) return fail();
  return original(path);
}

}  // extern "C"
