// Errors in the words of the command line, and the exit codes of the program.
#pragma once

#include <string>
#include <vector>

#include "io/errors/errors.h"

namespace tagrid {

// The numbers are those of <sysexits.h>.
inline constexpr int exit_ok = 0;
inline constexpr int exit_usage = 64;         ///< the command is wrong
inline constexpr int exit_broken_input = 65;  ///< the input is broken
inline constexpr int exit_bug = 70;           ///< a bug in tagrid
inline constexpr int exit_world = 74;         ///< a file, a disk or a permission failed
inline constexpr int exit_resumable = 75;     ///< interrupted, or held by another run: repeat the command

/// The message of the error with the names of options, and with advice. All code that shows errors to people
/// takes their messages from here, as what() names no options.
std::string words_of(const Error& error);

struct Failure {
  int code = 0;
  std::string message;                 ///< "" if no message is needed
  std::vector<std::string> list = {};  ///< lines that follow the message
};

/// For the exception that is being handled. Call it in a catch block. `memory_advice` says what needs less
/// memory; it is used if memory ran out, and "" if nothing would help.
Failure current_failure(const std::string& memory_advice = "");

}  // namespace tagrid
