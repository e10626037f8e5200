// The list of what `convert` encodes. A line a volume: its path, and tab-separated columns option=value.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "tools/options/encoding_options.h"

namespace tagrid {

struct ManifestLine {
  std::size_t number = 0;  ///< in the file, from 1
  std::string input;       ///< absolute
  std::string output;      ///< its name in the folder of the outputs: STEM.tag
  OptionTexts options;     ///< those of all lines, and over them those of this line
};

/// Reads the manifest at `path`, or the standard input for "-". Empty lines and those that begin with '#' are
/// none. Relative paths start at the folder of the manifest, or the current one where it comes from the
/// standard input. `given` are the options of all lines. Throws UsageError for an option that cannot be, and
/// for two lines with one output; WorldError.
std::vector<ManifestLine> read_manifest(const std::string& path, const OptionTexts& given);

/// `bytes` as text of JSON can hold them: file names may be of any bytes.
std::string json_text(const std::string& bytes);

}  // namespace tagrid
