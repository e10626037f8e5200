// Explains in one line why a command line cannot be understood.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace tagrid {

/// Says what is wrong, where, and what was perhaps meant or where to read on.
std::string explain(const CLI::App& app, const CLI::ParseError& error);

/// Which options of the command make it need less memory; "" where none does.
std::string memory_advice(const CLI::App& command);

}  // namespace tagrid
