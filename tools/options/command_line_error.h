// A command line that cannot be understood, in one line.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace tagrid {

/// What is wrong, where, and what was perhaps meant or where to read on.
std::string explain(const CLI::App& app, const CLI::ParseError& error);

/// Which options of the command make it need less memory; "" where none does.
std::string memory_advice(const CLI::App& command);

}  // namespace tagrid
