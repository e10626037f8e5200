// One process at a time gives a file its name, or removes the only other copy of what it holds.
//
// A run that removes originals proves first that a .tag file replaces them. Another run may give that name to another
// file in the meantime. So whoever renames or removes one of the two holds the lock of the .tag file, looks once more
// whether both are what it saw, and acts only then. The lock is held for an instant, never while a file is encoded or
// verified.
#pragma once

#include <string>

#include "io/files/system_call.h"

namespace tagrid {

/// The lock of one output: that of the hidden file `.NAME.lock` beside it, because a lock on the output itself would
/// stay with the older file when a new one gets the name. The destructor removes the file. A killed process leaves it,
/// but not the lock; the next process that locks the output removes the file. On file systems without locks it holds
/// nothing.
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
