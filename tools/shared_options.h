// Options that mean the same in every subcommand.
#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <optional>
#include <string>

#include "io/volume_info.h"
#include "io/volume_writer.h"
#include "tools/progress.h"

namespace tagrid {

struct RunOptions {
  int threads = 0;  ///< 0: what affinity allows
  bool quiet = false;
  int verbosity = 0;
  ProgressStyle progress = ProgressStyle::automatic;
  std::string json;  ///< file for the statistics of the run; "": none

  int thread_count() const;
};

/// For values that are one of a few words.
CLI::Validator one_of(const std::vector<std::string>& words);
/// For values that are whole numbers from 0 on.
CLI::Validator whole_number();

/// -T, -q, -v, --progress
void add_run_options(CLI::App& command, RunOptions& options);

/// --json FILE
void add_json_option(CLI::App& command, RunOptions& options);

/// -k, --rm
void add_removal_options(CLI::App& command, bool& remove);

struct OutputOptions {
  std::string path;
  bool overwrite = false;
};

/// -o, -f
void add_output_options(CLI::App& command, OutputOptions& options);

/// --dims, --type, --endian, --spacing, --offset: how the samples of headerless input lie.
struct RawOptions {
  std::vector<std::int64_t> dims;
  std::string type;
  std::string endian;
  std::vector<double> spacing;
  std::uint64_t offset = 0;

  /// Nothing where --dims was not given. Throws UsageError where --type is missing, or values are out of
  /// range.
  std::optional<RawDescription> description() const;
};

/// --format
void add_format_option(CLI::App& command, std::string& format);

/// The format that --format asks for, or where it was not given (""), the name of the output.
VolumeFormat volume_format_option(const std::string& format, const std::string& output);

/// The type that --type names; throws UsageError with those that exist.
SampleType sample_type_option(const std::string& name);

void add_raw_options(CLI::App& command, RawOptions& options);

/// Dims from "X,Y,Z"; throws UsageError unless all are positive and their product is reasonable.
Index3 checked_dims(const std::vector<std::int64_t>& dims);

/// Throws UsageError if `output` is the standard output and that is a terminal. `what` is binary.
void refuse_terminal(const std::string& output, const char* what);

/// Throws UsageError if `input` is the standard input and that is a terminal.
void refuse_terminal_input(const std::string& input);

/// A line on the standard error about what may be wrong.
void warn(const RunOptions& options, const std::string& message);

/// `input` without its ending, with `ending`; "-" for "-".
std::string output_beside(const std::string& input, const std::string& ending);

/// "1.2 MB" and the like: powers of 1000, as file managers count.
std::string human_bytes(std::uint64_t bytes);

}  // namespace tagrid
