// Metadata of meshes and surfaces, besides their arrays.
#pragma once

#include <string>

#include "io/volume/volume_info.h"

namespace tagrid {

struct MeshNotes {
  /// The coordinate system of the points: "LPS", "RAS", or as the source names another one, in letters that
  /// every format can hold; "" if it is not known.
  std::string space;
  Rescale rescale = {};  ///< what the values of points mean
  double spacing = 1;    ///< the smallest distance between samples, in units of the points

  bool has_rescale() const { return rescale.slope != 1 || rescale.intercept != 0; }
};

/// "SPACE=LPS", for comments and headers: 3D Slicer looks for such a text. "" if the space is not known.
inline std::string space_comment(const MeshNotes& notes) {
  return notes.space.empty() ? "" : "SPACE=" + notes.space;
}

/// The FieldData of a VTK XML file, with its line end: the space as 3D Slicer has it, and the slope and
/// intercept of `value`; "" if nothing is known.
std::string vtk_field_data(const MeshNotes& notes);

}  // namespace tagrid
