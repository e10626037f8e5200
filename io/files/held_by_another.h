// A file that another run holds, and who that is.
#pragma once

#include <string>

#include "io/errors/errors.h"
#include "io/files/system_call.h"

namespace tagrid {

/// Another run holds a file that this run needs. The same command works once that run has ended.
/// Exit code 75.
class HeldByAnother : public WorldError {
 public:
  using WorldError::WorldError;
};

/// A file that only one process at a time can hold, as long as this object exists. Others learn who
/// holds it from a hidden file `.NAME.holder` beside it, which the destructor removes; a killed
/// process leaves it, but does not hold the file.
class HeldFile {
 public:
  HeldFile() = default;
  /// Holds the open file `path` in `descriptor`. Throws HeldByAnother if another process does. On file systems without
  /// locks, the caller must ensure that there is only one.
  HeldFile(int descriptor, const std::string& path);
  ~HeldFile();
  HeldFile(const HeldFile&) = delete;
  HeldFile& operator=(const HeldFile&) = delete;

 private:
  std::string holder_;  ///< the hidden file; "" if there is none
  int slot_ = -1;
};

}  // namespace tagrid
