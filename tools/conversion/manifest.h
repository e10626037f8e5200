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
  std::string output;      ///< its path below the folder of the outputs: STEM.tag, or as was asked for
  OptionTexts options;     ///< those of all lines, and over them those of this line
};

/// How the outputs of volumes are called for which no column says it.
enum class OutputNaming {
  by_stem,      ///< 2019/knee.nhdr is knee.tag
  with_folders  ///< it is 2019/knee.tag
};

/// Reads the manifest at `path`, or the standard input for "-". Empty lines and those that begin with '#' are
/// passed over. Relative paths start at the folder of the manifest, or the current one if it comes from the
/// standard input. `given` are the options of all lines. Throws UsageError if a line has an option or an
/// output that cannot be, if two lines have one output, and if there is no volume; WorldError.
std::vector<ManifestLine> read_manifest(const std::string& path, const OptionTexts& given,
                                        OutputNaming naming);

}  // namespace tagrid
