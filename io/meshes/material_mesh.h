// A complete mesh with materials, as files for solvers have it: elements by material, and the named surfaces where
// materials end.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/files/spool_file.h"
#include "io/meshes/noted_file.h"

namespace tagrid {

/// The sides of the box of a mesh: an axis of the samples, and its lower or upper end.
inline constexpr std::array<std::string_view, 6> names_of_sides = {"x_min", "x_max", "y_min",
                                                                   "y_max", "z_min", "z_max"};

/// The tetrahedra of a material: elements `first` up to `first + count`.
struct MaterialElements {
  std::string name;  ///< letters, digits and underscores, the first one a letter; no two differ only in case
  std::int64_t label =
      0;  ///< the sample of a volume of labels; otherwise its place among all materials, from 1 on
  std::int64_t first = 0, count = 0;
};

/// Where a material of the mesh meets another one, a material that is no part of the mesh, or a side of the box: faces
/// `first` up to `first + count`. Each face at the end of a material is in exactly one surface.
struct MaterialSurface {
  std::string name;  ///< such as bone_soft, bone_air or bone_x_min; as those of materials
  /// Numbers in MaterialMesh::materials. The second is none where the mesh ends.
  std::size_t front = 0;
  std::optional<std::size_t> back;
  std::optional<int> side;  ///< one of names_of_sides, if it is one of the box
  std::int64_t first = 0, count = 0;
};

struct MaterialMesh {
  int order = 1;  ///< 1: elements have 4 nodes; 2: 10 nodes
  MeshNotes notes;
  std::string unit;  ///< of the coordinates, such as mm; "" if it is not known
  std::vector<MaterialElements> materials;
  std::vector<MaterialSurface> surfaces;

  // All numbers count from 0 on, and are int64, little endian.
  SpoolFile points;  ///< x y z of each point: float64, little endian
  /// For each element 4 or 10 points. The first 4 are corners in positive order; the others are the middles of the
  /// edges 01, 12, 02, 03, 13, 23, in this order.
  SpoolFile nodes;
  /// For each face 3 or 6 points. Corners are counterclockwise as seen from outside of the front material; then come
  /// the middles of the edges 01, 12, 02.
  SpoolFile face_nodes;
  /// For each face two numbers: where it is in the front material, and in the back material, if there is one, or -1.
  /// Each is 4 * the element + the corner of the element that is not on the face.
  SpoolFile faces;

  std::int64_t point_count() const { return static_cast<std::int64_t>(points.size() / (3 * sizeof(double))); }
  std::int64_t element_count() const {
    return static_cast<std::int64_t>(nodes.size() / (nodes_of_element() * sizeof(std::int64_t)));
  }
  std::size_t nodes_of_element() const { return order == 1 ? 4 : 10; }
  std::size_t nodes_of_face() const { return order == 1 ? 3 : 6; }
};

}  // namespace tagrid
