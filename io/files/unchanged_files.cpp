#include "io/files/unchanged_files.h"

#include "io/errors/errors.h"
#include "io/files/system_call.h"

namespace tagrid {

UnchangedFiles::UnchangedFiles(const std::vector<std::string>& files) {
  for (const std::string& file : files)
    if (const auto status = file == "-" ? std::nullopt : status_of(file);
        status && (S_ISREG(status->st_mode) || S_ISDIR(status->st_mode)))
      files_.push_back({file, *status});
}

std::uint64_t UnchangedFiles::memory(const std::vector<std::string>& files) {
  constexpr std::uint64_t allocations = 64;
  std::uint64_t sum = 0;
  // Vectors that grow may have twice the room.
  for (const std::string& file : files)
    sum += 2 * sizeof(Known) + sizeof file + 2 * file.size() + allocations;
  return sum;
}

std::string UnchangedFiles::touched() const {
  for (const auto& [path, was] : files_) {
    const auto now = status_of(path);
    if (now && (now->st_ctim.tv_sec != was.st_ctim.tv_sec || now->st_ctim.tv_nsec != was.st_ctim.tv_nsec))
      return path;
  }
  return "";
}

void UnchangedFiles::require() const {
  for (const auto& [path, was] : files_) {
    const auto now = status_of(path);
    if (!now || now->st_ino != was.st_ino || now->st_size != was.st_size ||
        now->st_mtim.tv_sec != was.st_mtim.tv_sec || now->st_mtim.tv_nsec != was.st_mtim.tv_nsec)
      throw BrokenInput(path + ": was changed while it was being read");
  }
}

}  // namespace tagrid
