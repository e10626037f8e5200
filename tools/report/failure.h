// What an exception means to whoever called the program.
#pragma once

#include <string>

namespace tagrid {

struct Failure {
  int code = 0;         ///< see exit_codes.h
  std::string message;  ///< "" where nobody needs to be told
};

/// The exception that is being handled. To be called in a catch block. `memory_advice` says what would need less
/// memory, where it ran out; "" where nothing would.
Failure current_failure(const std::string& memory_advice = "");

}  // namespace tagrid
