// Errors in the words of the command line: with the names of its options, and advice.
#pragma once

#include <string>

#include "io/errors/error_kinds.h"

namespace tagrid {

/// The message of the error for people who call the program. All code that shows errors to people takes them
/// from here, as what() names no options.
std::string words_of(const SortedError& error);
std::string words_of(const Error& error);

}  // namespace tagrid
