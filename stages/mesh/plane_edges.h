// The edges of the grid in a plane of the lattice: what a picture of a slice shows of the mesh.
//
// The plane cuts the leaf tetrahedra into triangles and quadrilaterals. Their edges lie in the faces of the
// tetrahedra, and end at lattice points (see cut.h).
#pragma once

#include <compare>
#include <cstdint>
#include <vector>

#include "stages/grid/lattice_bits.h"

namespace tagrid {

/// A place in a plane across `axis`: its coordinates along the two other axes, the lower axis first.
struct PlacePlane {
  std::int64_t across = 0, down = 0;
  friend constexpr auto operator<=>(const PlacePlane&, const PlacePlane&) = default;
};

struct PlaneEdge {
  PlacePlane from, to;  ///< from < to
  friend constexpr auto operator<=>(const PlaneEdge&, const PlaneEdge&) = default;
};

/// The edges in the plane where the coordinate along `axis` is `at`, in rising order, each once. Only
/// tetrahedra that meet the plane are visited. Any bits are safe. REQUIRES: active.box() consists of complete
/// root cubes, and the plane meets it.
std::vector<PlaneEdge> edges_in_plane(const LatticeBits& active, int cube_size, int axis, std::int64_t at);

}  // namespace tagrid
