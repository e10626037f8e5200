// The folder of a run in parts: `.NAME.parts/` beside the output.
#pragma once

#include <cstdint>
#include <string>

namespace tagrid {

/// Where the parts of a run are while it lasts. Every failure is a WorldError that names the folder.
class PartFolder {
 public:
  /// With `resumable` the folder of that name, new or as an earlier run left it, and locked until the end of
  /// this process. UsageError where another process has it, and where what has the name is not a folder of a
  /// run: a link, on another file system, or with other files in it and no record. Else a new one with a name
  /// of its own, which goes with its parts in the destructor, and when a signal ends the process.
  PartFolder(const std::string& output, bool resumable);
  ~PartFolder();
  PartFolder(const PartFolder&) = delete;
  PartFolder& operator=(const PartFolder&) = delete;

  const std::string& path() const { return path_; }
  std::string record() const { return path_ + "/run"; }
  static std::string part(const std::string& folder, std::int64_t number);

  /// Removes the folder: its parts first, then the record and the lock, so that until the end there is a
  /// record. Files that are none of a run stay, and the folder with them.
  void remove();
  /// Removes all but the record and the lock: what is there is complete.
  void remove_parts();
  /// Removes what a process that was killed had not completed.
  void remove_unfinished();
  /// Removes all but the lock: what is there cannot be continued.
  void clear();

 private:
  void require_own() const;
  void lock();

  std::string path_;
  bool resumable_;
  bool removed_ = false;
  int slot_ = -1;
  int lock_ = -1;
};

/// The name of the folder of a run that can be continued.
std::string part_folder_of(const std::string& output);

}  // namespace tagrid
