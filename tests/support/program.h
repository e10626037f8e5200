// The program that tests of commands run. It is the one that was built with the tests, unless the environment
// variable TAGRID_SANITIZED_PROGRAM names one that was built with sanitizers: then its tests need no second build.
#pragma once

#include <cstdlib>
#include <string>

#include "tests/support/sanitized.h"

namespace tagrid {

inline const char* sanitized_program() { return std::getenv("TAGRID_SANITIZED_PROGRAM"); }

inline std::string program_under_test() { return sanitized_program() ? sanitized_program() : TAGRID_PROGRAM; }

inline bool program_is_sanitized() { return sanitized || sanitized_program(); }

}  // namespace tagrid
