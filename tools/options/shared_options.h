// Options that mean the same in every subcommand.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <concepts>
#include <optional>
#include <string>

#include "io/errors/errors.h"
#include "io/formats/table/formats.h"
#include "io/volume/volume_info.h"
#include "pipeline/memory/resources.h"
#include "pipeline/ranks/ranks.h"
#include "tools/options/numbers.h"
#include "tools/report/progress.h"

namespace tagrid {

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
  if (!number) throw UsageError(fmt::format("{}: {}: must be {}", option, text, number_wanted<Number>()));
  value = *number;
}

/// Adds an option whose value is such a number.
template <class Value>
CLI::Option* add_number_option(CLI::App& command, const std::string& names, Value& value,
                               const std::string& description) {
  const std::string name = names.substr(names.rfind(',') + 1);
  const auto set = [name, &value](const std::string& text) { read_number(name, text, value); };
  return command.add_option_function<std::string>(names, set, description);
}
/// Accepts one of a few words.
CLI::Validator one_of(const std::vector<std::string>& words);

/// -T, -q, -v, --progress
void add_run_options(CLI::App& command, RunOptions& options);

/// -M
void add_memory_option(CLI::App& command, RunOptions& options);

/// --spool
void add_spool_option(CLI::App& command, RunOptions& options);

/// --json FILE
void add_json_option(CLI::App& command, RunOptions& options);

/// All of these, and -f for the report, for a command that writes nothing else.
void add_report_options(CLI::App& command, RunOptions& options, bool& overwrite);

/// -k, --rm
void add_removal_options(CLI::App& command, bool& remove);

/// --trust-description
void add_trust_option(CLI::App& command, bool& trust);

struct OutputOptions {
  std::string path;
  bool overwrite = false;
};

/// -o, -f
void add_output_options(CLI::App& command, OutputOptions& options);

/// --dims, --type, --endian, --spacing, --offset: the layout of the samples of headerless input.
struct RawOptions {
  std::string dims;
  std::string type;
  std::string endian;
  std::string spacing;
  std::string offset;

  /// Nothing if --dims was not given. Throws UsageError if --type is missing, or if values are out of range.
  std::optional<RawDescription> description() const;
};

/// --format
void add_format_option(CLI::App& command, std::string& format);

/// The format that --format names; if it was not given (""), the format that the name of the output implies.
/// Throws UsageError if a file's name implies a different format.
const Format& volume_format_option(const std::string& format, const std::string& output);

/// The type that --type names. Throws UsageError that lists the types.
SampleType sample_type_option(const std::string& name);

/// --dims
CLI::Option* add_dims_option(CLI::App& command, std::string& dims);

/// Dims from "X,Y,Z". Throws UsageError unless each is from 1 to 2^31.
Index3 dims_option(const std::string& dims);

/// Throws UsageError if `output` is the standard output and that is a terminal. `what` is binary.
void refuse_terminal(const Ranks& ranks, const std::string& output, const char* what);

/// Throws UsageError if `input` is standard input and that is a terminal.
void refuse_terminal_input(const std::string& input);
/// Throws UsageError if the name of a .tag file is that of a folder.
void refuse_folder(const std::string& input);

/// Writes a line to standard error about something that may be wrong.
void warn(const RunOptions& options, const std::string& message);

/// Removes the temporary files that killed runs left beside the outputs and the report: they may take as much
/// space as the outputs will. Nothing is removed if an input has the name of a temporary file.
void remove_abandoned(const RunOptions& options, const std::vector<std::string>& inputs,
                      std::vector<std::string> outputs);

/// `input` with `ending` instead of its own ending; "-" for "-".
std::string output_beside(const std::string& input, const std::string& ending);

}  // namespace tagrid
