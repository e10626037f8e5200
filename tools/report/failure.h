// The exit code and the message for an exception.
#pragma once

#include <string>

namespace tagrid {

struct Failure {
  int code = 0;         ///< see exit_codes.h
  std::string message;  ///< "" if no message is needed
};

/// For the exception that is being handled. Call it in a catch block.
Failure current_failure();

}  // namespace tagrid
