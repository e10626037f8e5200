// The key-value pair that has the positions of slices at unequal distances: "x y z; x y z".
#pragma once

#include <string_view>
#include <vector>

namespace tagrid {

inline constexpr std::string_view slice_positions_key = "slice_positions";

/// The positions in the value of this pair, as they are written: one for each slice.
std::vector<std::string_view> positions_in(std::string_view list);

}  // namespace tagrid
