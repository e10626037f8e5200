#include "pipeline/meshes/notes.h"

#include <algorithm>
#include <cmath>

#include "io/formats/nrrd/geometry.h"
#include "io/formats/nrrd/rescale.h"
#include "io/formats/nrrd/spaces.h"
#include "io/volume/lengths.h"

namespace tagrid {

namespace {

double smallest_spacing(const Geometry& geometry) {
  double smallest = INFINITY;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto& d = geometry.directions[axis];
    const double distance = geometry.has_directions ? std::hypot(d[0], d[1], d[2]) : geometry.spacing[axis];
    smallest = std::min(smallest, std::isnan(distance) ? 1 : std::abs(distance));
  }
  return smallest;
}

}  // namespace

MeshNotes notes_of(const TagHeader& header) {
  const Geometry geometry = in_one_unit(geometry_of(header.nrrd_fields));
  return {short_name_of_space(geometry.space), rescale_of(header.nrrd_fields), smallest_spacing(geometry)};
}

}  // namespace tagrid
