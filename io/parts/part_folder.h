// The directory of a run in parts: `.NAME.parts/` beside the output.
#pragma once

#include <cstdint>
#include <string>

#include "io/system/files.h"

namespace tagrid {

/// The place of the parts of a run while it lasts. Every failure is a WorldError that names the directory.
class PartFolder {
 public:
  /// With `resumable`: the directory with that name, new or from an earlier run, locked until the end of this
  /// process. Throws HeldByAnother if another process holds it, and UsageError if something else has its name: a link, a
  /// folder on another file system, or a directory with other files and no record. Otherwise: a new directory
  /// with a unique name, which is removed with its parts by the destructor, and when a signal ends the
  /// process.
  PartFolder(const std::string& output, bool resumable);
  ~PartFolder();

  const std::string& path() const { return path_; }
  std::string record() const { return path_ + "/run"; }
  static std::string part(const std::string& folder, std::int64_t number);

  /// Removes the directory: its parts first, then the record and the lock, so that there is a record until
  /// the end. Files that do not belong to a run stay, and then so does the directory.
  void remove();
  /// Removes everything except the record and the lock: the result is complete.
  void remove_parts();
  /// Removes files that a killed process had not completed.
  void remove_unfinished();
  /// Removes everything except the lock: the content cannot be continued.
  void clear();

 private:
  void require_own() const;
  void lock();

  std::string path_;
  bool resumable_;
  bool removed_ = false;
  int slot_ = -1;
  Descriptor lock_;
};

/// The name of the directory of a run that can be continued.
std::string part_folder_of(const std::string& output);

}  // namespace tagrid
