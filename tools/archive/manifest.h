// The list of volumes that `convert` encodes. Each line has a path and tab-separated columns option=value.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "tools/options/encoding_options.h"

namespace tagrid {

struct ManifestLine {
  std::size_t number = 0;  ///< in the file, from 1
  std::string input;       ///< absolute
  std::string output;      ///< its path below the folder of the outputs: STEM.tag, or as requested
  OptionTexts options;     ///< those for all lines, overridden by those of this line
};

/// Reads the manifest at `path`, or from standard input for "-". Empty lines and lines that begin with '#'
/// are skipped. Relative paths start at the folder of the manifest, or at the current folder if it comes from
/// standard input. Without a column for it, the output of 2019/knee.nhdr is knee.tag, or 2019/knee.tag with
/// `keep_folders`. `given` holds the options for all lines. Throws UsageError if a line has an invalid option
/// or output, if two lines have the same output, and if there is no volume; also throws WorldError.
std::vector<ManifestLine> read_manifest(const std::string& path, const OptionTexts& given, bool keep_folders);

}  // namespace tagrid
