// Options that decide what a .tag file will hold: those of encode, and of every line of convert's manifest.
#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <optional>
#include <string>

#include "io/volume/volume_source.h"
#include "pipeline/encode/options.h"
#include "pipeline/run/run.h"
#include "tools/options/shared_options.h"

namespace tagrid {

/// What they ask for.
struct Encoding {
  EncodeOptions options;
  SourceDescription source;
};

struct EncodingOptions {
  EncodeOptions options;
  std::string range;
  RawOptions raw;
  std::string vdb_grid;

  /// Throws UsageError where values are out of range or do not go together.
  Encoding checked() const;
};

/// --max-error and the other bounds, --accuracy and the rest of the grid, --dims and the like, --vdb-grid.
void add_encoding_options(CLI::App& command, EncodingOptions& options);

/// Such options as text, by their names without the dashes.
using OptionTexts = std::map<std::string, std::string>;

/// Those that were given to `command`, to which they were added.
OptionTexts encoding_options_given(const CLI::App& command);

/// What such texts mean, read as on the command line. Throws UsageError, also for names that are none of
/// these options.
Encoding encoding_of(const OptionTexts& texts);

/// Whether both make the same file of this volume, as far as can be said without reading it.
bool is_same_encoding(const Encoding& a, const Encoding& b, const VolumeSource& volume);
/// The first option in which two differ, in words.
std::string difference_of(const OptionTexts& was, const OptionTexts& now);

/// Says so where the type, the byte order, or the order of the dims of a headerless file is probably wrong.
void warn_of_description(const RunOptions& run, const std::string& input, const RawDescription& description);

/// Says so where the grid was made for the usual range of a type, and the samples span far more.
void warn_of_range(const RunOptions& run, const std::string& input, const EncodeOptions& asked,
                   const EncodeResult& result);

}  // namespace tagrid
