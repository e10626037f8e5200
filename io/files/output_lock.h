// Lets only one process at a time give a file its name, or remove what that file replaces.
//
// A run that removes originals first verifies that a .tag file replaces them. In the meantime,
// another run may give that name to another file. So whoever renames or removes one of the two
// locks the .tag file, checks once more that both are the files that were verified, and only then
// acts. The lock is held for a moment, never while a file is encoded or verified.
#pragma once

#include <string>

#include "io/files/system_call.h"

namespace tagrid {

/// The lock of one output: that of the hidden file `.NAME.lock` beside it, because a lock on the
/// output itself would stay with the older file when a new one gets the name. The destructor
/// removes the file. A killed process leaves it, but not the lock; the next process that locks the
/// output removes the file. On file systems without locks, it locks nothing.
class OutputLock {
 public:
  /// Waits until no other process holds the lock of the output `path`. Throws WorldError. REQUIRES: `path` is not a
  /// link; see file_of_link().
  explicit OutputLock(const std::string& path);
  ~OutputLock();
  OutputLock(const OutputLock&) = delete;
  OutputLock& operator=(const OutputLock&) = delete;

 private:
  std::string name_;
  int slot_ = -1;  ///< where its file is registered
  Descriptor descriptor_;
};

/// The hidden file of the lock of an output.
std::string lock_of_output(const std::string& path);

}  // namespace tagrid
