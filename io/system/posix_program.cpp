// What only a program does, not the library: its environment, its heap, its standard streams, its libraries.
#include <dlfcn.h>
#include <fcntl.h>
#include <malloc.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>

#include "io/system/this_process.h"

namespace tagrid {
namespace {

// The heap grows at once, in large pages. The system gives pages when they are first written, one at a time:
// of 4 KiB, that takes a seventh of an encoding, and more than that on virtual machines. Pages that are never
// written take no memory. malloc() itself can be told to do this only from outside of the program
// (GLIBC_TUNABLES), and mallopt() knows no large pages. So the heap is made to grow, and marked up to its
// end, which sbrk(0) is. See docs/dev/decisions/0037-large-pages.md.
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

std::vector<std::string> arguments_of_program(int count, char** arguments) {
  return {arguments + 1, arguments + count};
}

std::vector<std::string> environment() {
  std::vector<std::string> variables;
  for (char** variable = environ; *variable != nullptr; ++variable) variables.emplace_back(*variable);
  return variables;
}

std::string folder_for_temporaries() {
  const char* folder = std::getenv("TMPDIR");
  return folder != nullptr && *folder != '\0' ? folder : "/tmp";
}

void occupy_standard_streams() {
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(descriptor, F_GETFD) != -1 || errno != EBADF) continue;
    // The lowest free descriptor is this one. It is opened in the wrong mode, so that using it fails.
    if (open("/dev/null", descriptor == STDIN_FILENO ? O_WRONLY : O_RDONLY) < 0) return;
  }
}

std::FILE* divert_standard_output() {
  const int output = fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
  std::FILE* file = output < 0 ? nullptr : fdopen(output, "w");
  if (file != nullptr) dup2(STDERR_FILENO, STDOUT_FILENO);
  return file;
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

void give_back_free_memory() { malloc_trim(0); }

#ifdef TAGRID_STATIC
void* load_library(const char*) { return nullptr; }
void* function_of_library(void*, const char*) { return nullptr; }
#else
void* load_library(const char* name) { return dlopen(name, RTLD_NOW | RTLD_LOCAL); }
void* function_of_library(void* library, const char* name) { return dlsym(library, name); }
#endif

}  // namespace tagrid
