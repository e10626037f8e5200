// Headers of formats that tagrid does not read, as far as they say where samples lie plainly behind them.
#pragma once

#include <optional>
#include <string_view>

#include "io/volume/volume_info.h"

namespace tagrid {

// Each takes the first bytes of a file. Nothing if these are not the whole header, or if it says something
// that a description of plain samples cannot: other types, a scale, another order of axes. Safe for any bytes.

std::optional<RawDescription> layout_of_npy(std::string_view beginning);
std::optional<RawDescription> layout_of_mrc(std::string_view beginning);
std::optional<RawDescription> layout_of_mgh(std::string_view beginning);
std::optional<RawDescription> layout_of_edf(std::string_view beginning);
std::optional<RawDescription> layout_of_vff(std::string_view beginning);
std::optional<RawDescription> layout_of_fits(std::string_view beginning);

}  // namespace tagrid
