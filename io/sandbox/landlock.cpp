#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>

#include "io/errors/errors.h"
#include "io/sandbox/sandbox.h"
#include "io/system/files.h"

namespace tagrid {
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

}  // namespace tagrid
