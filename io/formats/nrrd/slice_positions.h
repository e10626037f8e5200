// The key-value pair that has the positions of slices at unequal distances: "x y z; x y z".
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace tagrid {

inline constexpr std::string_view slice_positions_key = "slice_positions";

/// The positions in the value of this pair, as they are written: one for each slice.
std::vector<std::string_view> positions_in(std::string_view list);

/// How far each slice of a volume lies from the first one, according to header lines with this pair; empty if they do not say
/// it of each slice.
std::vector<double> slice_distances(std::string_view nrrd_fields, std::int64_t slices);

}  // namespace tagrid
