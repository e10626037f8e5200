// Options as rows of a table, so that the command line and the lines of convert's manifest read the same
// options.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

#include "io/errors/errors.h"
#include "tools/options/shared_options.h"

namespace tagrid {

template <class Options>
struct OptionRow {
  std::string name;   ///< without dashes
  std::string group;  ///< heading in the help; "": the first one
  std::string value;  ///< name of its value in the help; "": a flag, whose value is true or false
  std::string help;
  /// Reads the value. Throws UsageError if it is invalid.
  std::function<void(Options&, const std::string& text)> set;
  std::vector<std::string> words = {};  ///< all possible values; empty: set() decides
};

/// The value of a flag; `name` is that of its option. Throws UsageError.
inline bool flag_value(const std::string& name, const std::string& text) {
  if (text != "true" && text != "false")
    throw UsageError("--" + name + ": " + text + ": must be true or false");
  return text == "true";
}

/// Adds the option of a row to a command; `options` must outlive it.
template <class Options>
CLI::Option* add_row(CLI::App& command, const OptionRow<Options>& row, Options& options) {
  const auto set = [&options, set = row.set](const std::string& text) { set(options, text); };
  const std::string name = "--" + row.name;
  CLI::Option* option = nullptr;
  if (row.value.empty()) {
    const auto set_flag = [set](std::int64_t count) { set(count > 0 ? "true" : "false"); };
    option = command.add_flag_function(name, set_flag, row.help);
  } else {
    option = command.add_option_function<std::string>(name, set, row.help)->option_text(row.value);
  }
  if (!row.words.empty()) option->check(one_of(row.words));
  if (!row.group.empty()) option->group(row.group);
  return option;
}

/// Reads a value that was not given on the command line. Throws UsageError.
template <class Options>
void set_row(const OptionRow<Options>& row, Options& options, const std::string& text) {
  if (!row.words.empty())
    if (const std::string wrong = one_of(row.words)(text); !wrong.empty())
      throw UsageError("--" + row.name + ": " + wrong);
  row.set(options, text);
}

}  // namespace tagrid
