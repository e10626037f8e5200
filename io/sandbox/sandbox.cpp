#include "io/sandbox/sandbox.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/text/text.h"

namespace tagrid {
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
