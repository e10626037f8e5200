// Files that only one run at a time may have: what they are for, and who has them.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "io/errors/errors.h"
#include "io/system/files.h"

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

/// An open file that this process holds, and that has its name: another run may have given the name to a new file.
struct HeldByName {
  /// Opens or creates the file. Throws HeldByAnother, WorldError, and UsageError if it is not a regular file.
  explicit HeldByName(const std::string& path);

  Descriptor descriptor;
  std::optional<HeldFile> held;
};

/// A file that grows by complete lines and is complete after every line: appended lines are durable at once.
/// One process at a time holds the file; see HeldFile. Failures are WorldErrors.
class LineFile {
 public:
  /// Opens the file, or creates it, so that its name is durable. Anything after the last '\n', half a line of a killed
  /// run, is cut off. Throws HeldByAnother if another process holds it.
  explicit LineFile(const std::string& path);

  /// Appends `line` and '\n': all of it, or nothing on failure. REQUIRES: no '\n' in `line`.
  void append(std::string_view line);
  /// The same for many lines, which become durable together.
  void append(std::span<const std::string> lines);
  /// The same, but a power failure may take the line until sync(). If that fails, all lines since the last one are
  /// taken back.
  void append_later(std::string_view line);
  void sync();
  const std::string& name() const { return name_; }

 private:
  void cut_half_line();
  void cut(std::uint64_t size);
  /// Throws WorldError by errno, after it has cut the file to this size.
  [[noreturn]] void fail_back_at(std::uint64_t size);
  void write(const std::string& text);

  std::string name_;
  HeldByName held_;
  const Descriptor& descriptor_;
  std::uint64_t size_ = 0, durable_ = 0;
};

/// Lets only one process at a time give a file its name, or remove what that file replaces.
///
/// A run that removes originals first verifies that a .tag file replaces them. In the meantime,
/// another run may give that name to another file. So whoever renames or removes one of the two
/// locks the .tag file, checks once more that both are the files that were verified, and only then
/// acts. The lock is held for a moment, never while a file is encoded or verified.
///
/// It is the lock of the hidden file `.NAME.lock` beside the output, because a lock on the output itself
/// would stay with the older file when a new one gets the name. The destructor removes the file. A killed
/// process leaves it, but not the lock; the next process that locks the output removes the file. On file
/// systems without locks, it locks nothing.
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
