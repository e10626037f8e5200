// Where samples lie, as VTK's image data says it.
#pragma once

#include <array>

#include "io/volume/volume_info.h"

namespace tagrid {

struct VtkGeometry {
  std::array<double, 3> origin, spacing;
  std::array<double, 9> direction;  ///< rows of a matrix whose columns are the axes
};

/// An unknown spacing is 1. All lengths are in one unit; see in_one_unit().
VtkGeometry vtk_geometry_of(const Geometry& geometry);

}  // namespace tagrid
