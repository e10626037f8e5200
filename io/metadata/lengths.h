// Units of lengths, and geometries in one unit.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "io/metadata/geometry.h"

namespace tagrid {

/// A unit of length. Whole numbers of femtometers make conversions exact if the result is exact.
struct LengthUnit {
  std::string_view name;  ///< the usual one: "um" for "micron", "µm" and the like
  double femtometers = 0;

  bool operator==(const LengthUnit&) const = default;
};

/// The unit with this name, in any of its spellings; nothing if it is not known, or not one of lengths.
/// "Millimeters" and "MM" are known, but "Mm" is not a millimeter.
std::optional<LengthUnit> length_unit(std::string_view name);

/// A length in another unit. Rounded once if one unit is a whole number of the other: 2500 um are 2.5 mm.
double converted(double length, const LengthUnit& from, const LengthUnit& to);

/// What is known about the unit of a geometry.
struct CommonUnit {
  /// The usual name of the unit of all axes with known spacings, or the name that they share; or "".
  std::string name;
  /// Axes have different units, or some of them have none.
  bool is_mixed = false;
  /// The units of all axes are known as lengths, so that in_unit() has a result.
  bool is_known = false;
};
CommonUnit common_unit(const Geometry& geometry);

/// The same places in the unit `name`, a known one. REQUIRES: common_unit(geometry).is_known.
Geometry in_unit(const Geometry& geometry, std::string_view name);

/// The same places in one unit, for formats that have one or none: that of the first axis, by its usual name,
/// if units are known; otherwise the geometry as it is.
Geometry in_one_unit(const Geometry& geometry);

/// A warning if axes in a file with these numbers have different, unknown units; "" otherwise.
std::string lost_by_mixed_units(const Geometry& geometry);

}  // namespace tagrid
