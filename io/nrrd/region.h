// The NRRD header lines of a region of a volume.
#pragma once

#include <string>
#include <string_view>

#include "stages/grid/box.h"

namespace tagrid {

/// NRRD header lines (see VolumeInfo::nrrd_fields) for the samples `low`, `low + step`, ... of a volume that has the
/// lines `nrrd_fields`: spacings and directions are those of the samples that are kept, the origin is the first one's.
/// What is not known stays so. Throws BrokenInput as geometry_of() does.
std::string fields_of_region(std::string_view nrrd_fields, Index3 low, Index3 step);

}  // namespace tagrid
