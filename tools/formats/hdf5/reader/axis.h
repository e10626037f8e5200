// A data set of one axis that says where samples lie.
#pragma once

#include <hdf5.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

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

/// The axis of `samples` samples that the data set is; the borders of samples become their centers. No axis
/// if the data set is not a list of as many finite numbers, or if it is in another directory than the file at
/// `path`.
AxisReading axis_of(hid_t dataset, std::uint64_t samples, const std::string& path);

}  // namespace tagrid
