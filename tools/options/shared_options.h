// Options that mean the same in every command.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <concepts>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "io/errors/errors.h"
#include "io/volume/volume_info.h"
#include "pipeline/memory/resources.h"
#include "pipeline/ranks/ranks.h"
#include "tools/options/numbers.h"
#include "tools/report/progress.h"

namespace tagrid {

/// Errors with a formatted message.
template <class... Values>
UsageError usage_error(fmt::format_string<Values...> message, Values&&... values) {
  return UsageError(fmt::format(message, std::forward<Values>(values)...));
}
template <class... Values>
BrokenInput broken_input_error(fmt::format_string<Values...> message, Values&&... values) {
  return BrokenInput(fmt::format(message, std::forward<Values>(values)...));
}

/// The largest value of -T.
constexpr int most_threads = 1024;

struct RunOptions {
  int threads = 0;  ///< 0: all that the affinity allows
  bool quiet = false;
  int verbosity = 0;
  ProgressStyle progress = ProgressStyle::automatic;
  std::string json;  ///< file for the statistics of the run; "": none
  std::optional<std::uint64_t> memory;
  std::string spool;

  int thread_count() const;
  /// Sets up the heap for the limit on memory, if there is one. Call it before anything large is allocated.
  void obey_memory_limit() const;
  /// True with -v, unless -q was given, too.
  bool is_verbose() const { return verbosity > 0 && !quiet; }
  /// True if a successful run prints one line about what it wrote: with -v or on a terminal, but
  /// not with -q.
  bool says_result() const;
  /// True with -v -v, unless -q was given, too: where the processor time went is shown.
  bool shows_times() const { return verbosity > 1 && !quiet; }
  /// True if progress is shown, or with -v. Remarks that are not errors are then shown, too.
  bool is_watched() const;
  /// The same description, with a limit on the memory of a reader that follows from the one of the run.
  SourceDescription limited(SourceDescription source) const;
  Resources resources(const Ranks& ranks) const;
  /// The same for any rank. The number of threads is 0 if the affinity determines it.
  Resources resources_of_each_rank() const;
};

/// Describes the possible values of a Number.
template <class Number>
std::string number_wanted() {
  if constexpr (std::unsigned_integral<Number>)
    return fmt::format("a whole number of at least 0 and below 2^{}", 8 * sizeof(Number));
  else if constexpr (std::integral<Number>)
    return "a whole number";
  else
    return "a finite number, such as 0.5";
}

/// Reads the value of an option that is a number (T, or std::optional<T>) as tools/options/numbers.h does;
/// anything else is a UsageError. The conversion of the option parser would read 020 as 16.
template <class Value>
void read_number(const std::string& option, const std::string& text, Value& value) {
  using Number = typename decltype(std::optional(value))::value_type;
  std::optional<Number> number;
  if constexpr (std::integral<Number>)
    number = whole_number<Number>(text);
  else
    number = finite_number(text);
  if (!number)
    throw UsageError("{}: {}: must be {}{}", option, text, number_wanted<Number>(),
                     std::integral<Number> ? "" : hint_of_decimal_comma(text, finite_number));
  value = *number;
}

/// Adds an option whose value is such a number. `value_name` is that of its value in the help.
template <class Value>
CLI::Option* add_number_option(CLI::App& command, const std::string& names, Value& value,
                               const std::string& value_name, const std::string& help) {
  const std::string name = names.substr(names.rfind(',') + 1);
  const auto set = [name, &value](const std::string& text) { read_number(name, text, value); };
  return command.add_option_function<std::string>(names, set, help)->option_text(value_name);
}

/// Adds an option whose value is any text.
CLI::Option* add_text_option(CLI::App& command, const std::string& names, std::string& value,
                             const std::string& value_name, const std::string& help);

/// Accepts one of a few words.
CLI::Validator one_of(const std::vector<std::string>& words);

/// INPUT, a .tag file. The user may give its address, of which `input` gets the name as a declared source.
CLI::Option* add_tag_input(CLI::App& command, std::string& input, const std::string& help);

/// The same for a command that takes one or more.
void add_tag_inputs(CLI::App& command, std::vector<std::string>& inputs, const std::string& help);

/// The same for a command that needs one, and takes pipes.
void add_tag_input(CLI::App& command, std::string& input);

/// Throws UsageError if such an input is a directory, or standard input that is a terminal.
void require_tag_input(const std::string& input);

/// -T, -q, -v, --progress
void add_run_options(CLI::App& command, RunOptions& options);

/// -M
void add_memory_option(CLI::App& command, RunOptions& options);

/// --json FILE
void add_json_option(CLI::App& command, RunOptions& options);

/// All of these, for a command that writes a volume or a mesh. `with_spool`: also --spool.
void add_job_options(CLI::App& command, RunOptions& options, bool with_spool);

/// All of these, and -f for the report, for a command that writes nothing else.
void add_report_options(CLI::App& command, RunOptions& options, bool& overwrite);

/// -k, --rm
void add_removal_options(CLI::App& command, bool& remove);

/// --trust-description
void add_trust_option(CLI::App& command, bool& trust);

/// True if a text has the form of an address (gs://, ftp://, http:/) but cannot be read, and is not
/// a path either, because `folder` has no directory of that name ("gs:").
bool is_unknown_address(const std::string& text, const std::filesystem::path& folder = ".");

/// What is wrong with such a text, without its secrets.
std::string about_unknown_address(const std::string& text);

/// Throws UsageError if `input` is an address that add_tag_input() did not take, or one that nothing can read.
/// `advice` ends the message.
void refuse_address(const std::string& input, std::string_view advice = "; download it first");

/// Throws UsageError for an address, and if `input` is standard input and that is a terminal: for commands that
/// read a volume of any format. `from_pipe`: such a command that reads a pipe, without "tagrid".
void require_volume_input(const std::string& input, std::string_view from_pipe);

/// Writes a line to standard error about something that may be wrong.
void warn(const RunOptions& options, const std::string& message);

template <class... Values>
void warn(const RunOptions& options, fmt::format_string<Values...> message, Values&&... values) {
  warn(options, fmt::format(message, std::forward<Values>(values)...));
}

/// Removes the temporary files that killed runs left beside the outputs and the report: they may take as much
/// space as the outputs will. Nothing is removed if an input has the name of a temporary file.
void remove_abandoned(const RunOptions& options, const std::vector<std::string>& inputs,
                      std::vector<std::string> outputs);

}  // namespace tagrid
