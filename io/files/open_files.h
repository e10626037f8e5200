// Files of a volume that are opened once and then read by several readers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "io/files/file_bytes.h"

namespace tagrid {

/// The files of a volume. They stay open, unless this process has too many open files already: then a file is opened
/// whenever it is read. A file that gets another name, or whose name another file gets, is still read: see
/// UnchangedFiles. Several threads may use it.
class OpenFiles {
 public:
  explicit OpenFiles(std::vector<std::string> paths);
  ~OpenFiles();
  OpenFiles(const OpenFiles&) = delete;
  OpenFiles& operator=(const OpenFiles&) = delete;

  const std::vector<std::string>& paths() const { return paths_; }
  /// Opens a file, if it is not open. Throws as FileSource does.
  std::shared_ptr<const FileSource> file(std::size_t number);

  /// Bytes of memory that this class needs for these files, with a copy of their names.
  static std::uint64_t memory(const std::vector<std::string>& paths);

 private:
  std::vector<std::string> paths_;
  std::vector<std::shared_ptr<const FileSource>> open_;  ///< null if it does not stay open
  std::size_t count_ = 0;                                ///< of those that do
  std::mutex mutex_;
};

}  // namespace tagrid
