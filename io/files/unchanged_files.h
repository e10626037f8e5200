// Files that must not change while they are read.
#pragma once

#include <sys/stat.h>

#include <string>
#include <vector>

namespace tagrid {

/// Remembers size, time and inode of files, which change with their content.
class UnchangedFiles {
 public:
  /// "-", the standard input, is left out. Throws WorldError.
  explicit UnchangedFiles(const std::vector<std::string>& files);

  /// Throws BrokenInput if one of the files has changed.
  void require() const;

 private:
  struct Known {
    std::string path;
    struct stat status;
  };
  std::vector<Known> files_;
};

}  // namespace tagrid
