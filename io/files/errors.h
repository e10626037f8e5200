// What can go wrong outside of the program, as exceptions. Each kind has an exit code of its own.
#pragma once

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

/// A WorldError that says where (`path`), what failed ("cannot open"), why (`error_number`, an errno) and,
/// where that is known, what to do.
WorldError world_error(std::string_view what, std::string_view path, int error_number);

}  // namespace tagrid
