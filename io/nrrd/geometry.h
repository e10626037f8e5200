// What NRRD header lines say of where the samples lie.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "io/volume/volume_info.h"

namespace tagrid {

/// The geometry that NRRD header lines (see VolumeInfo::nrrd_fields) state. Throws BrokenInput if a line is
/// none of an NRRD header, does not belong there, or says something that is not supported.
Geometry geometry_of(std::string_view nrrd_fields);

/// The NRRD header line for spacings, with its '\n'. Numbers read back as they are.
std::string spacings_line(const std::array<double, 3>& spacing);

}  // namespace tagrid
