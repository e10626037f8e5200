// Lists of positions along axes, which several formats store next to the samples, and one unit for
// all axes of a volume.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "io/metadata/lengths.h"
#include "io/metadata/metadata.h"

namespace tagrid {

struct Axis {
  std::vector<double> places;  ///< of all samples along the axis
  std::string unit;            ///< "" if unknown
  double rounding = 0;         ///< how far positions may be off, because of their type
  double width = 0;            ///< of a sample, if the file has the borders of samples

  /// The usual distance from one sample to the next; the width of the only one; NaN if that is not known.
  double step() const;
  /// True if all distances are equal: no position is off by more than one hundredth of them.
  bool is_even() const;
  /// True if all places differ, and each is after the one before it, or each before it.
  bool is_sorted() const;
};

/// An axis, or the reason why a data set is not one.
struct AxisReading {
  std::optional<Axis> axis;
  std::string why_not;  ///< "it has 5"
};

/// Longer lists of places are not read.
inline constexpr std::uint64_t most_places_of_axis = std::uint64_t{1} << 22;

/// Reads `numbers` as the axis of `samples` samples. Borders of samples become their centers. With
/// `may_be_first_two`, two numbers are continued at equal distances. No axis if there are too few
/// or too many numbers, or if one is not finite. `epsilon` is that of their type, 0 for integers.
AxisReading axis_of_numbers(std::vector<double> numbers, std::uint64_t samples, double epsilon,
                            bool may_be_first_two = false);

/// How axes with different units become axes with one unit.
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

/// Where axes put the samples of a volume.
struct PlacesOfAxes {
  Geometry geometry;
  KeyValues pairs;  ///< positions of uneven slices, and axes that a geometry cannot express
  std::vector<std::string> warnings;
  bool are_axes_placed = false;  ///< the directions describe axes that are not z, y, x
};

/// The description of a volume. An origin without a spacing is recorded without one, because a spacing of 1
/// would look as if it were stated.
Metadata metadata_of_places(const Geometry& geometry, const KeyValues& pairs);

/// Collects the positions along the axes x, y and z.
class AxesOfVolume {
 public:
  /// `path` is that of the file, for messages. Pairs that keep uneven places begin with `prefix`: "hdf5_".
  AxesOfVolume(std::string path, std::string prefix) : path_(std::move(path)), prefix_(std::move(prefix)) {}

  void add(std::size_t axis, const std::string& name, Axis places);
  void add_missing(std::size_t axis, const std::string& name, std::uint64_t samples, const std::string& why);
  /// There is only one sample along the axis, and nothing says where.
  void add_none(std::size_t axis) { is_placed_[axis] = true; }

  PlacesOfAxes finish();

 private:
  void convert_units();
  void place(std::size_t axis, const std::string& name, Axis places);
  void leave_out(std::size_t axis, const std::string& name, const Axis& places);
  void keep_slices();

  std::string path_, prefix_;
  PlacesOfAxes found_;
  std::array<std::string, 3> names_;
  std::array<std::optional<Axis>, 3> axes_;
  std::array<bool, 3> is_placed_ = {};
  std::optional<Axis> uneven_;
};

}  // namespace tagrid
