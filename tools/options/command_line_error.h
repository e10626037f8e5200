// Explains in one line why a command line cannot be understood.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace tagrid {

/// Explains the error: what is wrong, where, and what the user may have meant or where to read more.
std::string explain(const CLI::App& app, const CLI::ParseError& error);

/// The options of the command that reduce its memory; "" if none does.
std::string memory_advice(const CLI::App& command);

}  // namespace tagrid
