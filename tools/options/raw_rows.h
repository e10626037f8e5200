// The table of the options that describe headerless samples: --dims, --type, --endian, --spacing, --offset.
#pragma once

#include <vector>

#include "tools/options/option_row.h"

namespace tagrid {

const std::vector<OptionRow<RawOptions>>& raw_rows();

}  // namespace tagrid
