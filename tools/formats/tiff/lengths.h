// Distances between samples as texts of programs give them, each with a unit of its own.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "io/text/foreign_number.h"
#include "io/volume/volume_info.h"
#include "tools/formats/tiff/remarks.h"

namespace tagrid {

/// A distance along one axis.
struct GivenDistance {
  std::string name;  ///< of its field, for messages
  ForeignNumber number;
  std::string unit;
};

/// "um" for "micron" and the like, other units as they are.
std::string plain_unit(std::string_view unit);

/// The spacing, in the unit of the first axis that has one. It is unknown along an axis without a distance,
/// and along one whose distance or unit cannot be read, with a warning.
Geometry spacing_of(const std::array<GivenDistance, 3>& distances, TiffRemarks& remarks);

}  // namespace tagrid
