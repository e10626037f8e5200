// The description of a region of a volume, and the positions of its slices.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "io/metadata/metadata.h"
#include "stages/grid/box.h"

namespace tagrid {

/// The description of the samples `low`, `low + step`, ... of a volume: `slices` samples along z, of the
/// `all_slices` of the volume. Spacings and directions become those of the kept samples, and the origin that of
/// the first one. Pairs with an entry for each slice (all keys that begin with "slice_", such as
/// slice_positions) keep the entries of the kept slices. Equally spaced positions become a direction; unknown
/// values stay unknown.
Metadata metadata_of_region(const Metadata& whole, Index3 low, Index3 step, std::int64_t slices,
                            std::int64_t all_slices);

/// The same for the means of blocks of `factor` samples along each axis, the last ones perhaps of fewer, whose
/// places are the middles of blocks. Of pairs with an entry for each slice, slice_positions becomes that of the
/// middle of the slices of each block; the others are left out.
Metadata metadata_of_overview(const Metadata& whole, std::int64_t factor, std::int64_t all_slices);

/// The key-value pair that has the positions of slices at unequal distances: "x y z; x y z".
inline constexpr std::string_view slice_positions_key = "slice_positions";

/// The positions in the value of this pair, as they are written: one for each slice.
std::vector<std::string_view> positions_in(std::string_view list);

/// How far each slice of a volume lies from the first one, according to this pair; empty if it does not say it
/// of each slice.
std::vector<double> slice_distances(const Metadata& metadata, std::int64_t slices);

}  // namespace tagrid
