// Options that affect the content of a .tag file: those of encode, and of every line of convert's manifest.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "io/volume/volume_info.h"
#include "pipeline/job/options.h"
#include "pipeline/run/run.h"
#include "tools/options/shared_options.h"

namespace tagrid {

/// The help text of a volume as input: one list has all formats.
inline constexpr const char* volume_input_help =
    "Volume: a file, a directory of slices, or - for standard input; see tagrid formats";

/// The values of these options.
struct Encoding {
  EncodeOptions options;
  SourceDescription source;
};

/// The options that say how to read an input, as texts; "" if not given.
struct SourceOptions {
  std::string dims, type, endian, offset;  ///< the layout of headerless samples
  std::string spacing, override_spacing;
  std::string from, series, dataset, vdb_grid;
  bool gaps_ok = false;
  bool data_outside = false;

  /// Throws UsageError if values are out of range, or if only a part of a layout is given.
  SourceDescription description() const;

  bool operator==(const SourceOptions&) const = default;
};

struct EncodingOptions {
  EncodeOptions options;
  std::map<ErrorRule::Kind, double> rules;  ///< instead of max_error; more than one is refused
  std::string range;
  SourceOptions source;

  /// Throws UsageError if values are out of range or cannot be combined. `run` limits the memory of a reader.
  Encoding checked(const RunOptions& run = {}) const;
};

/// An option as a row of a table, which the command line and the lines of convert's manifest share.
struct OptionRow {
  std::string name;   ///< without dashes
  std::string group;  ///< heading in the help
  std::string value;  ///< name of its value in the help; "": a flag, whose value is true or false
  std::string help;
  /// Reads the value of `option`, its name with dashes. Throws UsageError if it is invalid.
  std::function<void(EncodingOptions&, const std::string& option, const std::string& text)> set;
  std::vector<std::string> words = {};  ///< all possible values; empty: set() decides
};

/// All options of a volume, in the order of the help.
const std::vector<OptionRow>& encoding_rows();

/// Reads a value that was not given on the command line. Throws UsageError.
void set_row(const OptionRow& row, EncodingOptions& options, const std::string& text);

/// Adds all rows to a command, without those that are named `but`. `options` must outlive it.
void add_encoding_options(CLI::App& command, EncodingOptions& options,
                          const std::vector<std::string>& but = {});

/// Adds only the rows that set `options.source`.
void add_source_options(CLI::App& command, EncodingOptions& options);

/// The texts of such options, by their names without dashes.
using OptionTexts = std::map<std::string, std::string>;

/// The options that were given to `command`, to which they were added.
OptionTexts encoding_options_given(const CLI::App& command);

/// Reads such texts as on the command line. Throws UsageError, also for names that are not among these
/// options. `run` limits the memory of a reader.
Encoding encoding_of(const OptionTexts& texts, const RunOptions& run = {});

/// "40" for "40:1", a ratio as people write it; other texts as they are.
std::string_view plain_ratio(std::string_view text);

/// The share of parity in "5%" or "5", in thousandths of a per cent; nothing for "none". Throws UsageError.
std::optional<std::uint32_t> parity_option(const std::string& option, const std::string& text);

/// Says that the samples of an input are copied, because they are read more than once; nothing with --quiet.
TellOfCopy tell_of_copy(const RunOptions& run);

/// --dims
CLI::Option* add_dims_option(CLI::App& command, std::string& dims);

/// Dims from "X,Y,Z". Throws UsageError unless each is from 1 to 2^31.
Index3 dims_option(const std::string& dims);

/// The type that --type names. Throws UsageError that lists the types.
SampleType sample_type_option(const std::string& name);

/// A warning if the type, the byte order, or the order of the dims of a headerless file is probably wrong; "" otherwise.
std::string doubt_of_description(const std::string& input, const RawDescription& description);

/// Says that the bound of an encoding is not below the range of the original samples, so that even a mask may be lost.
/// "" if it is, or if no sample has changed.
std::string lost_structure(const TagHeader& header, const Statistics& total);

/// All warnings of an encoding: those of the source; if a bound was rounded down to an integer; if the grid does not fit
/// the range of the samples, and a grid was asked for; and if the source was compressed with loss, and the .tag file is
/// larger.
std::vector<std::string> warnings_of_encoding(const std::string& input, const EncodeOptions& asked,
                                              const EncodeResult& result);

}  // namespace tagrid
