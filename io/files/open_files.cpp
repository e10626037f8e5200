#include "io/files/open_files.h"

#include <algorithm>
#include <atomic>

#include "io/system/this_process.h"

namespace tagrid {
namespace {

/// How many files of all volumes stay open.
std::atomic<std::size_t> all_open = 0;

/// Other parts of the program open few files.
std::size_t most_open() {
  constexpr std::size_t others = 64;
  static const std::size_t limit = most_open_files(), most = (limit - std::min(limit, others)) / 2;
  return most;
}

}  // namespace

OpenFiles::OpenFiles(std::vector<std::string> paths) : paths_(std::move(paths)), open_(paths_.size()) {}

OpenFiles::~OpenFiles() { all_open -= count_; }

std::shared_ptr<const FileSource> OpenFiles::file(std::size_t number) {
  const std::lock_guard lock(mutex_);
  if (open_.at(number)) return open_[number];
  auto file = std::make_shared<const FileSource>(paths_[number]);
  if (all_open >= most_open()) return file;
  ++all_open;
  ++count_;
  return open_[number] = std::move(file);
}

std::uint64_t OpenFiles::memory(const std::vector<std::string>& paths) {
  std::uint64_t bytes = 0;
  for (const std::string& path : paths) bytes += sizeof path + sizeof(FileSource) + 2 * path.size();
  return bytes;
}

}  // namespace tagrid
