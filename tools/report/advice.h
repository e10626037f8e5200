// Errors in the words of the command line: with the names of its options, and with what to do.
#pragma once

#include <string>

#include "io/files/error_kinds.h"

namespace tagrid {

/// What the error says to people who call the program. Whoever shows an error to them takes it from here:
/// what() knows no options.
std::string words_of(const SortedError& error);
std::string words_of(const Error& error);

}  // namespace tagrid
