// Spacings of an NRRD header that gives the ends of its axes.
#pragma once

#include <string>

#include "stages/grid/box.h"

namespace tagrid {

/// The header lines (see VolumeInfo::nrrd_fields), with the spacing of each axis that has none but an axis min and an axis
/// max, as teem has it: (max - min) / samples, or (max - min) / (samples - 1) if the axis is centered on nodes. teem, too,
/// takes an axis of unknown centering for one of cells. Lines with directions stay as they are. Throws as geometry_of() does.
std::string with_spacing_of_ends(const std::string& nrrd_fields, const Index3& dims);

}  // namespace tagrid
