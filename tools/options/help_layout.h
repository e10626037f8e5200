// How --help looks.
#pragma once

#include <CLI/CLI.hpp>

namespace tagrid {

/// Lays out the help of `app` and of all commands that are added later: no line is wider than 100 columns, and
/// the value of an option is in angle brackets, `--cube <S>`.
void lay_out_help(CLI::App& app);

}  // namespace tagrid
