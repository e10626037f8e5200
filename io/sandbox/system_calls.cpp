#include <fcntl.h>
#include <sched.h>
#include <seccomp.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>

#include <array>
#include <cerrno>
#include <memory>
#include <utility>

#include "io/errors/errors.h"
#include "io/sandbox/sandbox.h"

namespace tagrid {
namespace {

// By name, since older headers lack the later ones; names that the machine does not have are left out.
constexpr std::array calls = {
    // open files, and metadata of others
    "read", "readv", "pread64", "preadv", "write", "writev", "close", "close_range", "lseek", "_llseek",
    "fstat", "fstat64", "stat", "stat64", "lstat", "lstat64", "newfstatat", "fstatat64", "statx", "statfs",
    "statfs64", "fstatfs", "fstatfs64", "access", "faccessat", "faccessat2", "readlink", "readlinkat",
    "getdents", "getdents64", "getcwd", "fcntl", "fcntl64", "flock", "dup", "dup2", "dup3", "pipe", "pipe2",
    "poll", "ppoll", "select", "pselect6", "fadvise64", "readahead", "memfd_create", "pwrite64", "ftruncate",
    "umask",
    // memory
    "mmap", "mmap2", "munmap", "mremap", "mprotect", "madvise", "brk", "mincore", "get_mempolicy",
    "set_mempolicy", "mbind", "membarrier",
    // threads and signals
    "futex", "futex_time64", "set_robust_list", "get_robust_list", "rseq", "set_tid_address", "exit",
    "exit_group", "sched_yield", "sched_getaffinity", "sched_setaffinity", "sched_getparam",
    "sched_getscheduler", "getcpu", "rt_sigaction", "rt_sigprocmask", "rt_sigreturn", "sigreturn",
    "sigaltstack", "tgkill", "restart_syscall", "nanosleep", "clock_nanosleep", "clock_nanosleep_time64",
    // time, and the identity and location of this process
    "clock_gettime", "clock_gettime64", "clock_getres", "gettimeofday", "time", "times", "getrusage",
    "getpid", "getppid", "gettid", "getuid", "geteuid", "getgid", "getegid", "uname", "sysinfo", "getrlimit",
    "ugetrlimit", "prlimit64", "getrandom", "arch_prctl"};

using Filter = std::unique_ptr<void, decltype(&seccomp_release)>;

[[noreturn]] void fail(int error) { throw world_error("cannot enter", "the sandbox", error); }

void allow(const Filter& filter, const char* name, std::initializer_list<scmp_arg_cmp> arguments = {}) {
  const int number = seccomp_syscall_resolve_name(name);
  if (number < 0) return;
  const int result = seccomp_rule_add_array(filter.get(), SCMP_ACT_ALLOW, number,
                                            static_cast<unsigned>(arguments.size()), arguments.begin());
  if (result != 0) fail(-result);
}

scmp_arg_cmp is_masked(unsigned argument, scmp_datum_t mask, scmp_datum_t value) {
  return {argument, SCMP_CMP_MASKED_EQ, mask, value};
}
scmp_arg_cmp is(unsigned argument, scmp_datum_t value) { return {argument, SCMP_CMP_EQ, value, 0}; }

}  // namespace

void allow_calls_of_readers() {
  // ENOSYS, so that libraries fall back to older calls.
  const Filter filter(seccomp_init(SCMP_ACT_ERRNO(ENOSYS)), &seccomp_release);
  if (!filter) fail(ENOMEM);
  for (const char* name : calls) allow(filter, name);
  // Landlock decides which files can be opened, and how. Its first versions miss a file that is opened for
  // reading and truncated.
  for (const auto& [call, flags] : {std::pair("open", 1U), {"openat", 2U}}) {
    allow(filter, call, {is_masked(flags, O_TRUNC, 0)});
    for (const scmp_datum_t access : {O_RDWR, O_WRONLY})
      allow(filter, call, {is_masked(flags, O_ACCMODE, access)});
  }
  // Threads, not processes. No rule can see the flags of the newer call. If it is refused, the C library
  // falls back to this one.
#ifdef __s390__
  constexpr unsigned flags_of_clone = 1;
#else
  constexpr unsigned flags_of_clone = 0;
#endif
  allow(filter, "clone", {is_masked(flags_of_clone, CLONE_THREAD, CLONE_THREAD)});
  // Whether a stream is a terminal, and how much there is to read.
  for (const scmp_datum_t request : {TCGETS, TIOCGWINSZ, FIONREAD}) allow(filter, "ioctl", {is(1, request)});
  // Names of threads.
  for (const scmp_datum_t request : {PR_SET_NAME, PR_GET_NAME}) allow(filter, "prctl", {is(0, request)});
  if (const int result = seccomp_load(filter.get()); result != 0) fail(-result);
}

}  // namespace tagrid
