#include "tools/readers/tiff/lengths.h"

#include <fmt/format.h>

#include <utility>

#include "io/files/text.h"

namespace tagrid {
namespace {

/// Micrometers in a unit; 0 for one that is not known, or is no length.
double micrometers_in(std::string_view unit) {
  constexpr std::array<std::pair<std::string_view, double>, 20> units = {{{"fm", 1e-9},
                                                                          {"pm", 1e-6},
                                                                          {"nm", 1e-3},
                                                                          {"um", 1},
                                                                          {"mm", 1e3},
                                                                          {"cm", 1e4},
                                                                          {"dm", 1e5},
                                                                          {"m", 1e6},
                                                                          {"dam", 1e7},
                                                                          {"hm", 1e8},
                                                                          {"km", 1e9},
                                                                          {"\xc3\x85", 1e-4},
                                                                          {"\xe2\x84\xab", 1e-4},
                                                                          {"thou", 25.4},
                                                                          {"mil", 25.4},
                                                                          {"in", 25400},
                                                                          {"inch", 25400},
                                                                          {"ft", 304800},
                                                                          {"yd", 914400},
                                                                          {"meter", 1e6}}};
  for (const auto& [name, factor] : units)
    if (name == unit) return factor;
  return 0;
}

/// Of the OME model, and of ImageJ.
bool is_no_length(std::string_view unit) {
  return unit.empty() || unit == "pixel" || unit == "pixels" || unit == "reference frame";
}

}  // namespace

std::string plain_unit(std::string_view unit) {
  // The micro sign and the Greek letter, in UTF-8, in Latin-1, and as ImageJ escapes them.
  for (const std::string_view micro :
       {"micron", "microns", "um", "\xc2\xb5m", "\xce\xbcm", "\xb5m", "\\u00B5m", "\\u03BCm"})
    if (unit == micro) return "um";
  return std::string(unit);
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
    const double own = micrometers_in(unit), of_common = micrometers_in(common);
    if (unit != common && (own == 0 || of_common == 0)) {
      remarks.warn(fmt::format("{} has the unit {}, and another axis {}, which cannot be compared; {}", name,
                               quoted(unit), quoted(common), unknown));
      continue;
    }
    geometry.spacing[axis] = unit == common ? number.value : number.value * own / of_common;
    geometry.has_spacing = true;
  }
  if (geometry.has_spacing) geometry.units.fill(common);
  return geometry;
}

}  // namespace tagrid
