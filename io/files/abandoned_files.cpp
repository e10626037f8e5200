#include "io/files/abandoned_files.h"

#include <fcntl.h>
#include <linux/magic.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>
#include <map>
#include <set>
#include <system_error>

#include "io/files/system_call.h"
#include "io/files/temporaries.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

bool is_regular(int descriptor) {
  struct stat status = {};
  return fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode);
}

bool is_folder(int descriptor) {
  struct stat status = {};
  return fstat(descriptor, &status) == 0 && S_ISDIR(status.st_mode);
}

/// Removes a folder of files that were to get their names. An older file that was set aside is not removed: it may be the
/// only copy.
bool remove_new_files(const std::string& folder) {
  std::error_code error;
  std::vector<fs::path> files;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
    files.push_back(entry->path());
  for (const fs::path& file : files)
    if (file.extension() != ".old") unlink(file.c_str());
  return rmdir(folder.c_str()) == 0;
}

/// Removes a file, or with `folders` a folder, if no process holds it.
bool remove_if_abandoned(const std::string& path, bool folders) {
  const int descriptor =
      uninterrupted([&] { return open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC); });
  if (descriptor < 0) return false;
  // Removed while this process holds it: a process that is about to hold it will see that it is gone.
  const bool is_ours = is_local(descriptor) && (folders ? is_folder(descriptor) : is_regular(descriptor)) &&
                       lock_now(descriptor);
  const bool removed = is_ours && (folders ? remove_new_files(path) : unlink(path.c_str()) == 0);
  close(descriptor);
  return removed;
}

std::size_t remove_abandoned(const std::vector<std::string>& outputs, bool folders) {
  std::map<std::string, std::set<std::string>> names;
  for (const std::string& output : outputs)
    names[folder_of(output)].insert(name_in_temporary_names(fs::path(output).filename().string()));
  std::size_t removed = 0;
  for (const auto& [folder, targets] : names) {
    std::vector<std::string> abandoned;
    std::error_code error;
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
      const std::string name = entry->path().filename().string();
      if (const auto target = target_of_temporary(name); target && targets.contains(std::string(*target)))
        abandoned.push_back(entry->path().string());
    }
    for (const std::string& path : abandoned) removed += remove_if_abandoned(path, folders);
  }
  return removed;
}

}  // namespace

bool is_local(int descriptor) {
  constexpr std::uint32_t zfs = 0x2FC12FC1;
  constexpr std::array<std::uint32_t, 7> local = {
      EXT4_SUPER_MAGIC, XFS_SUPER_MAGIC,       BTRFS_SUPER_MAGIC, F2FS_SUPER_MAGIC, zfs,
      TMPFS_MAGIC,      OVERLAYFS_SUPER_MAGIC,
  };
  struct statfs status = {};
  return fstatfs(descriptor, &status) == 0 &&
         std::ranges::count(local, static_cast<std::uint32_t>(status.f_type)) > 0;
}

bool hold_temporary(int descriptor) {
  if (!is_local(descriptor)) return true;
  if (!lock_now(descriptor) && errno == EWOULDBLOCK) return false;
  struct stat status = {};
  return fstat(descriptor, &status) != 0 || status.st_nlink > 0;
}

std::size_t remove_abandoned_files(const std::vector<std::string>& outputs) {
  return remove_abandoned(outputs, false);
}
std::size_t remove_abandoned_folders(const std::vector<std::string>& outputs) {
  return remove_abandoned(outputs, true);
}

}  // namespace tagrid
