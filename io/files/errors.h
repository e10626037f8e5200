// What can go wrong outside of the program, as exceptions. Each kind has an exit code of its own.
#pragma once

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace tagrid {

/// The bytes that were given are wrong: not a volume, damaged, too short, too long. Exit code 65.
class BrokenInput : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The world failed: a missing file or folder, a permission, a full disk, a read or write error. Exit
/// code 74.
class WorldError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Whoever read our output is gone. Nobody needs to be told; exit code 74.
class ClosedPipe : public WorldError {
 public:
  using WorldError::WorldError;
};

/// The command is wrong, e.g. its output exists already. Exit code 64.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Work that does not fit into the memory that is allowed.
class MemoryLimit : public UsageError {
 public:
  /// `work` says what needs memory: "encoding 512 x 512 x 300 int16".
  MemoryLimit(const std::string& work, std::uint64_t allowed, std::uint64_t needed,
              std::optional<std::uint64_t> needed_with_spool);

  /// The smallest limit that can be kept, and the smallest one where samples may go through a temporary file,
  /// if that helps.
  std::uint64_t needed() const { return needed_; }
  std::optional<std::uint64_t> needed_with_spool() const { return needed_with_spool_; }

 private:
  std::uint64_t needed_;
  std::optional<std::uint64_t> needed_with_spool_;
};

/// A WorldError that says where (`path`), what failed ("cannot open"), why (`error_number`, an errno) and,
/// where that is known, what to do.
WorldError world_error(std::string_view what, std::string_view path, int error_number);

}  // namespace tagrid
