// Data sets of one axis that say where samples lie, and one unit for all axes of a volume.
#pragma once

#include <hdf5.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "io/volume/lengths.h"

namespace tagrid {

struct Axis {
  std::vector<double> places;  ///< of all samples along the axis
  std::string unit;            ///< "" if unknown
  double rounding = 0;         ///< places may be wrong by as much, as numbers of their type are
  double width = 0;            ///< of a sample, if the file has the borders of samples

  /// The usual distance from one sample to the next; the width of the only one; NaN if that is not known.
  double step() const;
  /// True if all distances are equal.
  bool is_even() const;
  /// True if all places differ, and each is after the one before it, or each before it.
  bool is_sorted() const;
};

/// An axis, or the reason why a data set is none.
struct AxisReading {
  std::optional<Axis> axis;
  std::string why_not;  ///< "it has 5"
};

/// The axis of `samples` samples that the data set is; the borders of samples become their centers. With
/// `may_be_first_two`, two numbers go on at equal distances. No axis if the data set is not a list of as many
/// finite numbers, or if it is in another directory than the file at `path`.
AxisReading axis_of(hid_t dataset, std::uint64_t samples, const std::string& path,
                    bool may_be_first_two = false);

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
