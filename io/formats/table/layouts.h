// Headers of formats that tagrid does not read: where their samples begin, if they are
// uncompressed.
#pragma once

#include <optional>
#include <string_view>

#include "io/volume/volume_info.h"

namespace tagrid {

// Each function is given the first bytes of a file. It returns nothing if these are not the whole
// header, or if a description of plain samples cannot express it: other types, a scale, another
// order of axes. Safe for any bytes.

std::optional<RawDescription> layout_of_mgh(std::string_view beginning);
std::optional<RawDescription> layout_of_fits(std::string_view beginning);

}  // namespace tagrid
