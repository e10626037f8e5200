#include "tools/formats/tiff/lengths.h"

#include <fmt/format.h>

#include "io/text/text.h"
#include "io/volume/lengths.h"

namespace tagrid {
namespace {

/// Of the OME model, and of ImageJ.
bool is_no_length(std::string_view unit) {
  return unit.empty() || unit == "pixel" || unit == "pixels" || unit == "reference frame";
}

}  // namespace

std::string plain_unit(std::string_view unit) {
  const auto known = length_unit(unit);
  return known && known->name == "um" ? "um" : std::string(unit);
}

Geometry spacing_of(const std::array<GivenDistance, 3>& distances, TiffRemarks& remarks) {
  constexpr std::array axes = {"x", "y", "z"};
  Geometry geometry;
  std::string common;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto& [name, number, unit] = distances[axis];
    const std::string unknown = fmt::format("the spacing along {} is unknown", axes[axis]);
    if (number.is_absent()) continue;
    if (number.is_unreadable() || number.decimal_comma) remarks.warn(remark_on(number, name, unknown));
    if (!number.is_number()) continue;
    if (number.value <= 0) {
      remarks.warn(fmt::format("{} is {}, which is no distance; {}", name, quoted(number.text), unknown));
      continue;
    }
    if (is_no_length(unit)) {
      remarks.warn(fmt::format("{} has the unit {}, which is no length; {}", name, quoted(unit), unknown));
      continue;
    }
    if (common.empty()) common = unit;
    const auto own = length_unit(unit), of_common = length_unit(common);
    if (unit != common && !(own && of_common)) {
      remarks.warn(fmt::format("{} has the unit {}, and another axis {}, which cannot be compared; {}", name,
                               quoted(unit), quoted(common), unknown));
      continue;
    }
    geometry.spacing[axis] = unit == common ? number.value : converted(number.value, *own, *of_common);
    geometry.has_spacing = true;
  }
  if (geometry.has_spacing) geometry.units.fill(common);
  return geometry;
}

}  // namespace tagrid
