#include "io/files/open_files.h"

#include <algorithm>

#include "io/system/this_process.h"

namespace tagrid {
namespace {

/// Other parts of the program open few files.
std::size_t most_open() {
  constexpr std::size_t others = 64;
  static const std::size_t limit = most_open_files(), most = (limit - std::min(limit, others)) / 2;
  return most;
}

}  // namespace

OpenFiles::OpenFiles(std::vector<std::string> paths)
    : paths_(std::move(paths)), open_(std::min(paths_.size(), most_open())) {}

std::shared_ptr<const FileSource> OpenFiles::file(std::size_t number) {
  const auto opened = [&] { return std::make_shared<const FileSource>(paths_[number]); };
  if (number >= open_.size()) return opened();
  const std::lock_guard lock(mutex_);
  if (!open_[number]) open_[number] = opened();
  return open_[number];
}

std::uint64_t OpenFiles::memory(const std::vector<std::string>& paths) {
  std::uint64_t bytes = 0;
  for (std::size_t i = 0; i < paths.size(); ++i)
    bytes += (sizeof(std::string) + paths[i].size()) +
             (i < most_open() ? sizeof(FileSource) + paths[i].size() : 0);
  return bytes;
}

}  // namespace tagrid
