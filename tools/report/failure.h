// The exit code and the message for an exception.
#pragma once

#include <string>
#include <vector>

namespace tagrid {

struct Failure {
  int code = 0;                        ///< see exit_codes.h
  std::string message;                 ///< "" if no message is needed
  std::vector<std::string> list = {};  ///< lines that follow the message
};

/// For the exception that is being handled. Call it in a catch block. `memory_advice` says what needs less
/// memory; it is used if memory ran out, and "" if nothing would help.
Failure current_failure(const std::string& memory_advice = "");

}  // namespace tagrid
