// The command line as a whole: how its help looks, and why it cannot be understood.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tagrid {

/// Lays out the help of `app` and of all commands that are added later: no line is wider than 100 columns,
/// and the value of an option is in angle brackets, `--cube <S>`.
void lay_out_help(CLI::App& app);

/// Explains the error in one line: what is wrong, where, and what the user may have meant.
std::string explain(const CLI::App& app, const CLI::ParseError& error);

/// The options of the command that reduce its memory; "" if none does.
std::string memory_advice(const CLI::App& command);

/// The candidate with the fewest insertions, deletions, replacements and swaps of neighboring letters from
/// `word`; nothing if there are more of these than a third of its letters.
std::optional<std::string> nearest(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace tagrid
