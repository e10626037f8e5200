// Names for the outputs of volumes that were found.
#pragma once

#include <string>

#include "tools/options/encoding_options.h"

namespace tagrid {

/// The place of an output: `relative`, the path of the file or folder of the volume, and below it the series or data set
/// that `options` choose. It depends on nothing else, and different volumes have different ones. What a path cannot have,
/// here or on Windows, is written as %2F.
std::string output_name_of(const std::string& relative, const OptionTexts& options);

}  // namespace tagrid
