// The position of samples in the world, as NRRD header lines give it.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "io/metadata/entries.h"
#include "io/volume/volume_info.h"

namespace tagrid {

/// The geometry that NRRD header lines (see VolumeInfo::nrrd_fields) give. Throws BrokenInput if a line is
/// not one of an NRRD header, does not belong there, or has content that is not supported.
Geometry geometry_of(std::string_view nrrd_fields);

/// The description of a volume with these header lines, and the geometry that they give. Throws as
/// geometry_of() does.
VolumeInfo volume_info(const Index3& dims, SampleType type, std::string nrrd_fields);

/// Adds what samples mean, if they are not the values themselves: rescale_slope, rescale_intercept,
/// rescale_units.
void add_rescale(const Rescale& rescale, KeyValues& pairs);

/// NRRD header lines for a geometry and key-value pairs. Reading them back gives the same numbers. In keys,
/// characters that NRRD could take for something else become '_'; in texts, line feeds and backslashes are
/// escaped as NRRD has it.
std::string nrrd_fields_of(const Geometry& geometry, const KeyValues& pairs);

/// The NRRD header line for spacings, with its '\n'. Reading it back gives the same numbers.
std::string spacings_line(const std::array<double, 3>& spacing);

}  // namespace tagrid
