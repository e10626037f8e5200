#include <fcntl.h>
#include <pthread.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/random.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <fstream>
#include <new>

#include "io/errors/errors.h"
#include "io/system/files.h"
#include "io/system/this_process.h"

namespace tagrid {
namespace {

// As much as oneTBB gives its threads, and assumes that others have. The guard below is not accessible.
constexpr std::size_t stack_bytes = std::size_t{4} << 20, guard_bytes = std::size_t{1} << 16;

// Not a stack of the C library, which a forked process gives to its next threads: lists of oneTBB lead
// through the stacks of threads that slept when the process was forked.
void* map_stack() {
  void* mapped = mmap(nullptr, guard_bytes + stack_bytes, PROT_READ | PROT_WRITE,
                      MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE | MAP_STACK, -1, 0);
  if (mapped == MAP_FAILED) return nullptr;
  if (mprotect(mapped, guard_bytes, PROT_NONE) == 0) return mapped;
  munmap(mapped, guard_bytes + stack_bytes);
  return nullptr;
}

}  // namespace

int process_number() { return getpid(); }

std::string host_name() {
  std::array<char, 256> host = {};
  gethostname(host.data(), host.size() - 1);
  return host.data();
}

std::optional<std::filesystem::path> program_path() {
  std::error_code unknown;
  std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", unknown);
  return unknown ? std::nullopt : std::optional(std::move(program));
}

void call_after_fork(void (*action)()) { pthread_atfork(nullptr, nullptr, action); }

bool start_lasting_thread(void* (*work)(void*), void* given) {
  pthread_attr_t attributes;
  if (pthread_attr_init(&attributes) != 0) return false;
  void* const mapped = map_stack();
  pthread_t thread;
  const bool made =
      mapped != nullptr &&
      pthread_attr_setstack(&attributes, static_cast<std::byte*>(mapped) + guard_bytes, stack_bytes) == 0 &&
      pthread_attr_setdetachstate(&attributes, PTHREAD_CREATE_DETACHED) == 0 &&
      pthread_create(&thread, &attributes, work, given) == 0;
  pthread_attr_destroy(&attributes);
  if (!made && mapped != nullptr) munmap(mapped, guard_bytes + stack_bytes);
  return made;
}

bool is_terminal(int stream) { return isatty(stream) != 0; }

std::size_t columns_of_terminal() {
  winsize size = {};
  return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0 ? std::string::npos : size.ws_col;
}

std::size_t most_open_files() {
  constexpr rlim_t most = 8192;
  rlimit limit;
  return getrlimit(RLIMIT_NOFILE, &limit) == 0 ? std::min(limit.rlim_cur, most) : 0;
}

bool fill_with_random(std::span<unsigned char> bytes) {
  return uninterrupted([&] { return getrandom(bytes.data(), bytes.size(), 0); }) ==
         static_cast<ssize_t>(bytes.size());
}

double processor_seconds_of_thread() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double processor_seconds() {
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

bool to_local_time(std::time_t time, std::tm& parts) { return localtime_r(&time, &parts) != nullptr; }

int usable_processors() {
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof set, &set) != 0) return 1;
  return std::max(1, CPU_COUNT(&set));
}

std::uint64_t memory_of_machine() {
  const auto pages = static_cast<std::uint64_t>(std::max(sysconf(_SC_PHYS_PAGES), 1L));
  return pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

std::uint64_t memory_of_this_process() {
  std::uint64_t size = 0, resident = 0, of_files = 0;
  std::ifstream statm("/proc/self/statm");
  if (!(statm >> size >> resident >> of_files) || resident < of_files) return 0;
  return (resident - of_files) * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
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

char* MappedFile::map(int file, std::size_t size) {
  void* const mapped = mmap(nullptr, size, PROT_READ, MAP_SHARED, file, 0);
  return mapped == MAP_FAILED ? nullptr : static_cast<char*>(mapped);
}

MappedFile::~MappedFile() {
  if (bytes_ != nullptr) munmap(bytes_, size_);
}

FileForLibrary::FileForLibrary() : open_(memfd_create("plain", MFD_CLOEXEC)) {
  if (open_ < 0) throw world_error("cannot make", "a file in memory", errno);
  path_ = path_of_open_file(open_);
}
FileForLibrary::FileForLibrary(const std::string& folder, const std::string& whose)
    : open_(files().open_nameless(folder)) {
  if (open_ < 0) throw world_error("cannot create a temporary file in " + folder, whose, errno);
  path_ = path_of_open_file(open_);
}
FileForLibrary::~FileForLibrary() { close(open_); }
bool FileForLibrary::has_name() { return false; }
bool FileForLibrary::leave_holes() const { return true; }

}  // namespace tagrid
