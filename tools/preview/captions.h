// The words of a preview.
#pragma once

#include <string>
#include <vector>

#include "io/tag/bricks.h"
#include "io/volume/volume_info.h"
#include "stages/picture/panel.h"

namespace tagrid {

/// The position of samples in the words of a preview.
struct Lengths {
  Geometry geometry;
  Index3 dims;
  std::vector<double> of_slices = {};  ///< slice_distances(), in the unit of the geometry

  /// The unit of lengths along an axis; "samples" if the spacing is unknown, "" if only the unit is.
  std::string unit(int axis) const;
  /// The distance of two samples in that unit.
  double spacing(int axis) const;
  /// How far a slice across an axis lies from the first one, in that unit.
  double distance(int axis, std::int64_t slice) const;
};

/// Those of a file, in one unit.
Lengths lengths_of(const TagHeader& header);

/// What the volume with this number in `file` is: size, type, spacing; how well it is kept: bound, errors; and the ratio
/// of all volumes to the file.
std::vector<std::string> lines_about(const TagBricks& file, std::int64_t number, const TagBricks& volume);

/// "12.5 mm", or "12.5 units" if the unit is unknown.
std::string length_words(double length, const std::string& unit);
/// "z = 20 of 0..59, 12.5 mm": the distance from the first slice; and whether the panel is not to scale.
std::string slice_caption(const Panel& panel, const Lengths& lengths);
/// "x to the right, z up"
std::string direction_caption(const Panel& panel);
/// A number with at most six digits.
std::string short_number(double value);

}  // namespace tagrid
