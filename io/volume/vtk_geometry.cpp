#include "io/volume/vtk_geometry.h"

#include "io/volume/lengths.h"

namespace tagrid {

VtkGeometry vtk_geometry_of(const Geometry& of_volume) {
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

}  // namespace tagrid
