// Distances between samples in files of other programs.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "io/text/foreign_number.h"
#include "io/volume/volume_info.h"

namespace tagrid {

/// Whether the format gives a negative distance a meaning.
enum class NegativeSpacing {
  mirrors,     ///< The axis runs the other way.
  is_unknown,  ///< It has no meaning.
};

/// Sets the spacing of the first axes, up to three. Unreadable numbers and 0 have no meaning and stay
/// unknown. Adds a sentence to `warnings` for each; `names` are those of the fields, one for each axis, or
/// one for all.
void set_spacing(const std::vector<ForeignNumber>& numbers, const std::vector<std::string>& names,
                 NegativeSpacing negative, Geometry& geometry, std::vector<std::string>& warnings);

}  // namespace tagrid
