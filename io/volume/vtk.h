// Places and types of samples, as VTK's files give them.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "io/metadata/lengths.h"
#include "io/volume/volume_info.h"
#include "stages/sample/sample_type.h"

namespace tagrid {

struct VtkGeometry {
  std::array<double, 3> origin, spacing;
  std::array<double, 9> direction;  ///< rows of a matrix whose columns are the axes
};

/// An unknown spacing is 1. All lengths are in one unit; see in_one_unit().
inline VtkGeometry vtk_geometry_of(const Geometry& of_volume) {
  const Geometry geometry = in_one_unit(of_volume);
  VtkGeometry vtk = {geometry.origin, {}, {}};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    vtk.spacing[axis] = spacing_or_1(geometry, axis);
    for (std::size_t row = 0; row < 3; ++row)
      vtk.direction[3 * row + axis] =
          geometry.has_directions ? geometry.directions[axis][row] / vtk.spacing[axis] : axis == row;
  }
  return vtk;
}

/// What VTK calls a type of samples.
constexpr std::string_view vtk_name_of(SampleType type) {
  constexpr std::array<std::string_view, all_sample_types.size()> names = {
      "UInt8", "Int8", "UInt16", "Int16", "UInt32", "Int32", "Float32", "Float64"};
  return names[static_cast<std::size_t>(type) - 1];
}

}  // namespace tagrid
