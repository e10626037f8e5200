#include "io/abandoned_files.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <map>
#include <set>
#include <system_error>

#include "io/system_call.h"
#include "io/temporaries.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

bool lock(int descriptor, int how) {
  return uninterrupted([&] { return flock(descriptor, how | LOCK_NB); }) == 0;
}

/// Some file systems lock only what is open for writing, and some files may only be read.
int open_to_lock(const std::string& path) {
  constexpr int flags = O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC;
  const int descriptor = uninterrupted([&] { return open(path.c_str(), O_RDWR | flags); });
  if (descriptor >= 0 || errno != EACCES) return descriptor;
  return uninterrupted([&] { return open(path.c_str(), O_RDONLY | flags); });
}

bool remove_if_abandoned(const std::string& path) {
  const int descriptor = open_to_lock(path);
  if (descriptor < 0) return false;
  struct stat status = {};
  // Removed while it is held: who is about to hold it sees that it is gone.
  const bool removed = fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode) &&
                       lock(descriptor, LOCK_EX) && unlink(path.c_str()) == 0;
  close(descriptor);
  return removed;
}

}  // namespace

bool hold_temporary(int descriptor) {
  if (!lock(descriptor, LOCK_EX) && errno == EWOULDBLOCK) return false;
  struct stat status = {};
  return fstat(descriptor, &status) != 0 || status.st_nlink > 0;
}

void hold_for_reading(int descriptor) { lock(descriptor, LOCK_SH); }

std::size_t remove_abandoned_files(const std::vector<std::string>& outputs) {
  std::map<fs::path, std::set<std::string>> names;
  for (const std::string& output : outputs) {
    const fs::path path(output);
    names[path.has_parent_path() ? path.parent_path() : "."].insert(
        name_in_temporary_names(path.filename().string()));
  }
  std::size_t removed = 0;
  for (const auto& [folder, targets] : names) {
    std::vector<std::string> abandoned;
    std::error_code error;
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
      const std::string name = entry->path().filename().string();
      if (const auto target = target_of_temporary(name); target && targets.contains(std::string(*target)))
        abandoned.push_back(entry->path().string());
    }
    for (const std::string& path : abandoned) removed += remove_if_abandoned(path);
  }
  return removed;
}

}  // namespace tagrid
