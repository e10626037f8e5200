// The position of samples in the world, as NRRD header lines give it.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/volume/volume_info.h"

namespace tagrid {

/// The geometry that NRRD header lines (see VolumeInfo::nrrd_fields) give. Throws BrokenInput if a line is
/// not one of an NRRD header, does not belong there, or has content that is not supported.
Geometry geometry_of(std::string_view nrrd_fields);

/// The description of a volume with these header lines, and the geometry that they give. Throws as
/// geometry_of() does.
VolumeInfo volume_info(const Index3& dims, SampleType type, std::string nrrd_fields);

/// What else is known about a volume: names and texts.
using KeyValues = std::vector<std::pair<std::string, std::string>>;

/// Adds what samples mean, if they are not the values themselves: rescale_slope, rescale_intercept, rescale_units.
void add_rescale(const Rescale& rescale, KeyValues& pairs);

/// The key-value pairs of NRRD header lines, in order. Throws BrokenInput if a line is not one of a header.
KeyValues key_values_of(std::string_view nrrd_fields);

/// The key under which readers say that samples were compressed with a loss before, and by what: "TIFF, JPEG".
inline constexpr std::string_view lossy_source_key = "lossy source";

/// The text of a key; "" if there is none. Throws as key_values_of() does.
std::string text_of_key(std::string_view nrrd_fields, std::string_view key);

/// NRRD header lines without what is not needed to understand the samples: of key-value pairs, only slopes, intercepts and
/// positions of slices stay, what OpenVDB grids need, and doubts; comments and the content go.
std::string stripped(std::string_view nrrd_fields);

/// NRRD header lines for a geometry and key-value pairs. Reading them back gives the same numbers. In keys, characters
/// that NRRD could take for something else become '_'; in texts, line feeds and backslashes are escaped as NRRD has it.
std::string nrrd_fields_of(const Geometry& geometry, const KeyValues& pairs);

/// The NRRD header line for spacings, with its '\n'. Reading it back gives the same numbers.
std::string spacings_line(const std::array<double, 3>& spacing);

}  // namespace tagrid
