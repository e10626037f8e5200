// Units of length, and one unit for all axes of a volume.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

namespace tagrid {

/// mantissa * 10^exponent meters.
struct MeterUnit {
  double mantissa = 1;
  int exponent = 0;

  bool operator==(const MeterUnit&) const = default;
};

/// The unit of this name: "mm", "micron", "Angstrom"; nothing if it is none of length, or not known.
std::optional<MeterUnit> length_unit_of(std::string_view name);

/// A length in another unit. Rounded once if both are powers of ten: 2500 um are 2.5 mm.
double converted(double length, const MeterUnit& from, const MeterUnit& to);

/// How axes with units of their own become axes of one unit.
struct UnitOfAxes {
  struct Conversion {
    MeterUnit from, to;
  };
  std::array<std::string, 3> units;                      ///< of the axes x, y, z from then on
  std::array<std::optional<Conversion>, 3> conversions;  ///< of their lengths
  std::string remark;  ///< a sentence on units that cannot be converted into each other; "" if all is well

  double convert(std::size_t axis, double length) const;
};

/// The unit that most of the `used` axes have; the first one, if several are as frequent.
UnitOfAxes common_unit(const std::array<std::string, 3>& units, const std::array<bool, 3>& used);

}  // namespace tagrid
