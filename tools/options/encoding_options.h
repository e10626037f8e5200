// Options that affect the content of a .tag file: those of encode, and of every line of convert's manifest.
#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <optional>
#include <string>

#include "io/volume/volume_source.h"
#include "pipeline/job/options.h"
#include "pipeline/run/run.h"
#include "tools/options/shared_options.h"
#include "tools/options/source_rows.h"

namespace tagrid {

/// The help text of a volume as input: one list has all formats.
inline constexpr const char* volume_input_help =
    "Volume: a file, a directory of slices, or - for standard input; see tagrid formats";

/// The values of these options.
struct Encoding {
  EncodeOptions options;
  SourceDescription source;
};

struct EncodingOptions {
  EncodeOptions options;
  std::map<ErrorRule::Kind, double> rules;  ///< instead of max_error; more than one is refused
  std::string range;
  SourceOptions source;

  /// Throws UsageError if values are out of range or cannot be combined. `run` limits the memory of a reader.
  Encoding checked(const RunOptions& run = {}) const;
};

/// --max-error and the other bounds, --accuracy and the rest of the grid, --dims and other options of the
/// input. Without those that are named `but`.
void add_encoding_options(CLI::App& command, EncodingOptions& options,
                          const std::vector<std::string>& but = {});

/// The texts of such options, by their names without dashes.
using OptionTexts = std::map<std::string, std::string>;

/// The options that were given to `command`, to which they were added.
OptionTexts encoding_options_given(const CLI::App& command);

/// Reads such texts as on the command line. Throws UsageError, also for names that are not among these
/// options. `run` limits the memory of a reader.
Encoding encoding_of(const OptionTexts& texts, const RunOptions& run = {});

/// Warns if the type, the byte order, or the order of the dims of a headerless file is probably wrong.
void warn_of_description(const RunOptions& run, const std::string& input, const RawDescription& description);

/// Warns if the grid was made for the usual range of a type, but the samples span far more.
void warn_of_range(const RunOptions& run, const std::string& input, const EncodeOptions& asked,
                   const EncodeResult& result);

/// Warns if the samples were already compressed with loss, and the .tag file is larger than what they came
/// from.
void warn_of_lossy_source(const RunOptions& run, const std::string& input, const EncodeResult& result);

}  // namespace tagrid
