// Exceptions sorted by what they mean to whoever started the program. Nothing else sorts them.
#pragma once

#include <cstdint>
#include <exception>
#include <string>

#include "io/files/errors.h"

namespace tagrid {

enum class ErrorKind : std::uint8_t {
  usage,         ///< UsageError
  broken_input,  ///< BrokenInput
  closed_pipe,   ///< ClosedPipe
  world,         ///< WorldError, and what the standard library throws of the system
  memory,        ///< there is not enough, or a size is beyond all memory
  bug            ///< anything else
};

struct SortedError {
  ErrorKind kind = ErrorKind::bug;
  std::string message;  ///< what() of it
  ErrorDetail detail{};

  bool operator==(const SortedError&) const = default;
};

/// REQUIRES: an exception.
SortedError sorted_error(const std::exception_ptr& exception);

/// Throws an exception of that kind with that message and detail; of `memory` without.
[[noreturn]] void throw_sorted(const SortedError& error);

}  // namespace tagrid
