// One unit for all axes of a volume.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "io/volume/lengths.h"

namespace tagrid {

/// How axes with units of their own become axes of one unit.
struct UnitOfAxes {
  struct Conversion {
    LengthUnit from, to;
  };
  std::array<std::string, 3> units;                      ///< of the axes x, y, z from then on
  std::array<std::optional<Conversion>, 3> conversions;  ///< of their lengths
  std::string remark;  ///< a sentence on units that cannot be converted into each other; "" if all is well

  double convert(std::size_t axis, double length) const;
};

/// The unit that most of the `used` axes have; the first one, if several are as frequent.
UnitOfAxes common_unit(const std::array<std::string, 3>& units, const std::array<bool, 3>& used);

}  // namespace tagrid
