// The table of the options of a volume: how to encode it, and the description of its input.
#pragma once

#include <vector>

#include "tools/options/encoding_options.h"
#include "tools/options/option_row.h"

namespace tagrid {

/// In the order of the help. These are the options of encode and convert, and of every line of convert's
/// manifest.
const std::vector<OptionRow<EncodingOptions>>& encoding_rows();

}  // namespace tagrid
