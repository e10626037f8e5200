// Files that must not change while they are read.
#pragma once

#include <sys/stat.h>

#include <cstdint>
#include <string>
#include <vector>

namespace tagrid {

/// Remembers size, time and inode of files, which change with their content.
class UnchangedFiles {
 public:
  /// Ignores the standard input ("-"), pipes and devices, whose times say nothing. Throws WorldError.
  explicit UnchangedFiles(const std::vector<std::string>& files);

  /// Bytes of memory that this class needs for these files, with a copy of their names.
  static std::uint64_t memory(const std::vector<std::string>& files);

  /// Throws BrokenInput if one of the files has changed.
  void require() const;

  /// The first file that was written, linked or given other rights since, although its size, time and inode
  /// are the same: a program may have set its time back. Returns "" if no file was touched.
  std::string touched() const;

 private:
  struct Known {
    std::string path;
    struct stat status;
  };
  std::vector<Known> files_;
};

}  // namespace tagrid
