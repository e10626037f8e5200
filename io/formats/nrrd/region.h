// The NRRD header lines of a region of a volume.
#pragma once

#include <string>
#include <string_view>

#include "stages/grid/box.h"

namespace tagrid {

/// NRRD header lines (see VolumeInfo::nrrd_fields) for the samples `low`, `low + step`, ... of a volume whose
/// lines are `nrrd_fields`; `slices` of them along z, of the `all_slices` of the whole volume. Spacings and directions are
/// those of the samples that are kept; the origin is that of the first one. Pairs that list something for each slice
/// (slice_positions, and all others whose keys begin with "slice_") list it for those that are kept. Positions of slices
/// that are at equal distances become their direction. What is unknown stays unknown. Throws BrokenInput as geometry_of() does.
std::string fields_of_region(std::string_view nrrd_fields, Index3 low, Index3 step, std::int64_t slices,
                             std::int64_t all_slices);

}  // namespace tagrid
