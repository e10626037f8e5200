// Sorts exceptions by what they mean to the person who started the program. Nothing else sorts them.
#pragma once

#include <cstdint>
#include <exception>
#include <string>

#include "io/errors/errors.h"

namespace tagrid {

enum class ErrorKind : std::uint8_t {
  usage,         ///< UsageError
  broken_input,  ///< BrokenInput
  closed_pipe,   ///< ClosedPipe
  world,         ///< WorldError, and system errors of the standard library
  memory,        ///< there is too little memory, or a size is beyond all memory
  bug            ///< anything else
};

struct SortedError {
  ErrorKind kind = ErrorKind::bug;
  std::string message;  ///< what() of the exception
  ErrorDetail detail{};

  bool operator==(const SortedError&) const = default;
};

/// REQUIRES: `exception` is not null.
SortedError sorted_error(const std::exception_ptr& exception);

/// Throws an exception of that kind with that message and detail; for `memory`, without them.
[[noreturn]] void throw_sorted(const SortedError& error);

}  // namespace tagrid
