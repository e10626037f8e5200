// What files with one unit and one space cannot record of a geometry.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "io/volume/volume_info.h"

namespace tagrid {

/// A format of such files.
struct OneSpaceFormat {
  std::string_view name;          ///< "NIfTI"
  std::string_view space;         ///< that of its positions: "right-anterior-superior"
  std::string_view unknown_unit;  ///< a clause: what comes of lengths whose unit is not known
};

/// Sentences for users; none if nothing is lost.
std::vector<std::string> lost_places(const Geometry& geometry, const OneSpaceFormat& format);

}  // namespace tagrid
