#include "io/sandbox/sandbox.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sched.h>
#include <seccomp.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/system/files.h"
#include "io/text/text.h"

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

namespace {

// The kernel's interface. Headers of older kernels lack its later parts.
struct Ruleset {
  std::uint64_t files = 0, network = 0, scopes = 0;
};
struct [[gnu::packed]] PathBeneath {
  std::uint64_t allowed = 0;
  std::int32_t folder = -1;
};
constexpr std::uint32_t ask_version = 1, path_beneath = 1;
constexpr std::uint64_t read_file = 1 << 2, read_folder = 1 << 3;

#ifndef SYS_landlock_create_ruleset
#define SYS_landlock_create_ruleset 444
#define SYS_landlock_add_rule 445
#define SYS_landlock_restrict_self 446
#endif

/// Everything that this version can forbid.
Ruleset everything(int version) {
  const int files = version >= 5 ? 16 : version >= 3 ? 15 : version == 2 ? 14 : 13;
  return {.files = (std::uint64_t{1} << files) - 1,
          .network = version >= 4 ? std::uint64_t{3} : 0,  // bind and connect
          .scopes = version >= 6 ? std::uint64_t{3} : 0};  // abstract sockets, signals
}

std::size_t size_of_ruleset(int version) { return version >= 6 ? 24 : version >= 4 ? 16 : 8; }

void allow(int rules, const std::string& path, std::uint64_t of_folders) {
  const Descriptor place(open(path.c_str(), O_PATH | O_CLOEXEC));
  struct stat status = {};
  if (place < 0 || fstat(place, &status) != 0) return;
  const PathBeneath rule{S_ISDIR(status.st_mode) ? of_folders : read_file, place};
  if (syscall(SYS_landlock_add_rule, rules, path_beneath, &rule, 0) == 0) return;
  // A file system of the kernel's own, such as that of files in memory. Landlock takes no rules for it, and
  // forbids nothing on it.
  if (errno != EBADFD) throw world_error("cannot enter the sandbox for", path, errno);
}

}  // namespace

int landlock_version() {
  const long version = syscall(SYS_landlock_create_ruleset, nullptr, 0, ask_version);
  return version < 0 ? 0 : static_cast<int>(version);
}

void allow_reading_only(const Readable& readable) {
  const int version = landlock_version();
  if (version == 0) return;
  const Ruleset forbidden = everything(version);
  const Descriptor rules(
      static_cast<int>(syscall(SYS_landlock_create_ruleset, &forbidden, size_of_ruleset(version), 0)));
  if (rules < 0) throw world_error("cannot make", "the sandbox", errno);
  for (const std::string& path : readable.paths) allow(rules, path, read_file | read_folder);
  for (const std::string& path : readable.listed) allow(rules, path, read_folder);
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 ||
      syscall(SYS_landlock_restrict_self, static_cast<int>(rules), 0) != 0)
    throw world_error("cannot enter", "the sandbox", errno);
}

namespace {

#ifdef TAGRID_SANITIZED
constexpr bool can_confine = false;  // sanitizers write reports, and start programs for them
#else
constexpr bool can_confine = true;
#endif

namespace fs = std::filesystem;

// Files that libraries read at run time: plug-ins, dictionaries, character sets. TBB counts processors.
constexpr const char* of_libraries[] = {"/usr/lib",         "/usr/lib64",      "/usr/libexec", "/usr/share",
                                        "/usr/local/lib",   "/usr/local/hdf5", "/lib",         "/lib64",
                                        "/etc/ld.so.cache", "/etc/localtime",  "/etc/dcmtk",   "/proc/self",
                                        "/proc/cpuinfo",    "/proc/meminfo",   "/sys/devices", "/dev/null",
                                        "/dev/urandom",     "/sys/fs/cgroup"};
// Colon-separated paths that users set for libraries.
constexpr const char* of_users[] = {"HDF5_PLUGIN_PATH", "DCMDICTPATH", "LD_LIBRARY_PATH"};

/// A directory of slices may have links to slices elsewhere. This limit is higher than any reader needs.
constexpr std::size_t most_entries = 200'000;

void add_listed(const char* variable, std::vector<std::string>& paths) {
  const char* value = std::getenv(variable);
  for (const std::string_view path : split(value == nullptr ? "" : value, ':'))
    if (!path.empty()) paths.emplace_back(path);
}

/// The shared libraries in the two directories above each directory of plug-ins, which find there
/// what they need ($ORIGIN/.., as in conda). Other files in these directories stay closed, because
/// one of them may be the home directory of a user.
void add_libraries_of_plugins(std::vector<std::string>& paths) {
  std::vector<std::string> folders;
  add_listed("HDF5_PLUGIN_PATH", folders);
  for (fs::path folder : folders)
    for (int above = 0; above < 2; ++above) {
      std::error_code error;
      folder = fs::weakly_canonical(folder, error).parent_path();
      if (std::ranges::any_of(of_libraries, [&](const char* known) { return is_below(folder, known); }))
        break;
      for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
        const std::string name = entry->path().filename().string();
        if (name.starts_with("lib") && name.find(".so") != name.npos) paths.push_back(entry->path().string());
      }
    }
}

/// The targets of links in a folder, and of those in the folders that links lead to. Of the folder, only `part` is
/// searched, and what lies beside it and the folders above it.
void add_targets(const fs::path& folder, const fs::path& part, std::vector<std::string>& paths) {
  std::error_code error;
  std::set<fs::path> known = {fs::canonical(folder, error)};  // links may lead in circles
  std::deque<fs::path> folders = {folder};
  const auto is_searched = [&](const fs::path& entry) {
    return folders.front() != folder || is_below(part, entry) || is_below(entry, part);
  };
  std::size_t count = 0;
  for (; !folders.empty(); folders.pop_front()) {
    for (fs::recursive_directory_iterator
             entry(folders.front(), fs::directory_options::skip_permission_denied, error),
         end;
         !error && entry != end && count < most_entries; entry.increment(error), ++count) {
      std::error_code of_entry;
      if (!entry->is_symlink(of_entry)) {
        if (!is_searched(entry->path())) entry.disable_recursion_pending();
        continue;
      }
      // The target of a link may be a link, too.
      const fs::path target = fs::canonical(entry->path(), of_entry);
      if (of_entry) continue;
      paths.push_back(target.string());
      if (fs::is_directory(target, of_entry) && known.insert(target).second) folders.push_back(target);
    }
  }
}

/// Hidden entries that are no secrets: those of Zarr, and what systems put into every directory.
bool is_harmless(std::string_view name) {
  return !name.starts_with('.') || name.starts_with(".z") || name.starts_with("._") || name == ".DS_Store";
}

/// The directory of a scan.
void add_folder(const fs::path& folder, const fs::path& part, Readable& readable) {
  std::error_code error;
  std::vector<std::string> entries;
  bool has_hidden = false;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (is_harmless(entry->path().filename().string()))
      entries.push_back(entry->path().string());
    else
      has_hidden = true;
  }
  if (error || !has_hidden) {
    readable.paths.push_back(folder.string());
  } else {
    // A rule for a directory holds for all of it, so its entries have one each.
    readable.paths.insert(readable.paths.end(), entries.begin(), entries.end());
    readable.listed.push_back(folder.string());
  }
  add_targets(folder, part, readable.paths);
}

/// A file, and those of its directory that it may need.
void add_file(const fs::path& file, const FilesBeside& beside, Readable& readable) {
  const fs::path folder = file.parent_path();
  const std::string own = file.filename().string();
  if (beside.names_a_tree && beside.names_a_tree(own)) {
    add_folder(folder, folder, readable);
    return;
  }
  readable.paths.push_back(file.string());
  if (beside.are_listed) readable.listed.push_back(folder.string());
  if (!beside.may_need) return;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    std::error_code of_entry;
    if (!name.starts_with('.') && beside.may_need(own, name) && entry->is_regular_file(of_entry))
      readable.paths.push_back(entry->path().string());
  }
}

Readable readable_by(const std::string& path, const FilesBeside& beside, const std::string& part) {
  Readable readable{{std::begin(of_libraries), std::end(of_libraries)}, {}};
  for (const char* variable : of_users) add_listed(variable, readable.paths);
  add_libraries_of_plugins(readable.paths);
  std::error_code error;
  // Its directory may be the home of a user.
  if (const fs::path program = fs::read_symlink("/proc/self/exe", error); !error)
    readable.paths.push_back(program.string());
  const fs::path given = fs::absolute(path, error);
  if (error) return readable;
  if (fs::is_directory(given, error)) {
    fs::path of_part = (given / part).lexically_normal();
    if (!of_part.has_filename()) of_part = of_part.parent_path();  // of "a/"
    add_folder(given, fs::is_directory(of_part, error) ? of_part : given, readable);
    return readable;
  }
  add_file(given, beside, readable);
  // Files that a header names lie beside the header itself, not beside a link to it.
  if (const fs::path itself = fs::canonical(given, error); !error && itself != given)
    add_file(itself, beside, readable);
  return readable;
}

}  // namespace

bool sandbox_is_on() {
  const char* wanted = std::getenv("TAGRID_SANDBOX");
  return can_confine && (wanted == nullptr || std::string_view(wanted) != "off");
}

std::string sandbox_in_words() {
  if (!sandbox_is_on()) return "off";
  const int version = landlock_version();
  return version == 0 ? "seccomp (this kernel has no Landlock, so files are not protected)"
                      : fmt::format("Landlock {}, seccomp", version);
}

void confine_to(const std::string& path, const FilesBeside& beside, const std::string& part) {
  if (!sandbox_is_on()) return;
  // A core dump of a compromised process is a file, too.
  const rlimit none = {0, 0};
  setrlimit(RLIMIT_CORE, &none);
  allow_reading_only(readable_by(path, beside, part));
  blame_sandbox_for_permissions();
  allow_calls_of_readers();
}

}  // namespace tagrid
