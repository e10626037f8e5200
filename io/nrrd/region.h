// The NRRD header lines of a region of a volume.
#pragma once

#include <string>
#include <string_view>

#include "stages/grid/box.h"

namespace tagrid {

/// NRRD header lines (see VolumeInfo::nrrd_fields) for the samples `low`, `low + step`, ... of a volume whose
/// lines are `nrrd_fields`; `slices` of them along z. Spacings and directions are those of the samples that are kept; the
/// origin is that of the first one. Lists with an entry for each slice (slice_positions) have those of the slices that are
/// kept. What is unknown stays unknown. Throws BrokenInput as geometry_of() does.
std::string fields_of_region(std::string_view nrrd_fields, Index3 low, Index3 step, std::int64_t slices);

}  // namespace tagrid
