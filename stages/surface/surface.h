// The isosurface of the piecewise linear field in a brick.
//
// The leaf tetrahedra of the brick, cut at the border of the volume as a mesh is, are marched. A vertex of
// the grid is inside or outside, which exact comparisons decide, so that the topology of the surface is a
// function of one bit for each vertex: within the volume, the surface of a conforming grid has no border, no
// matter how many values are equal to the level.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "stages/grid/lattice_bits.h"
#include "stages/sample/sample_type.h"

namespace tagrid {

/// The requested surface.
struct SurfaceLevel {
  /// In units of samples. A vertex of the grid is inside if its value is at least this. It is outside,
  /// though, if its value is just this, no neighbor has more, and no triangle at it has all corners inside: a
  /// surface there would have no extent. Neighbors are those of
  /// CommonNeighbours; NaN counts as more, or as outside if the surface is closed. On faces
  /// of root cubes, those that are so put outside on their edges no longer count; inside, those on faces and
  /// edges.
  double value = 0;
  /// A vertex is inside if its value is at most the level: samples fall where values rise.
  bool falling = false;

  constexpr bool is_inside(double sample) const { return falling ? sample <= value : sample >= value; }
};

/// The tetrahedra that are marched.
struct SurfaceGrid {
  int cube_size = 32;
  /// All samples: tetrahedra are cut at the first and the last ones. REQUIRES: more than one along each axis.
  Box volume;
  /// Only tetrahedra that meet this box; both ends are included.
  std::optional<Box> box = std::nullopt;
  /// The surface is closed at the border of the volume and around NaN, as if values there were outside.
  bool close = false;
};

/// A vertex of the surface, on an edge of the grid. Its ends are numbers of points in the box of the brick, x
/// fastest.
struct SurfaceVertex {
  std::uint32_t low = 0, high = 0;  ///< low < high; or low == high: a vertex of the grid
  double at = 0;                    ///< from 0 at `low` to 1 at `high`
};

struct BrickSurface {
  /// In the raster order of the midpoints of their edges.
  std::vector<SurfaceVertex> vertices;
  /// Each with three vertices, which are counterclockwise if seen from outside, in a right-handed system.
  std::vector<std::array<std::uint32_t, 3>> triangles;
  /// Edges of triangles that lie in the border of the volume and belong to one triangle. None if the surface
  /// is closed.
  std::int64_t border_edges = 0;
  /// True if a tetrahedron was left out because a value is NaN, so that there are other edges with one
  /// triangle.
  bool has_gaps = false;
};

/// The isosurface in a brick.
///
/// A vertex lies where the linear interpolation between the ends of its edge, computed in doubles from the
/// low end, reaches the level; at the finite end if one of them is infinite or NaN, and in the middle if both
/// are infinite; at the inside end if both have the level. If a vertex of the grid has exactly the level,
/// vertices of the surface on several edges lie there, and triangles between them have no area. A tetrahedron
/// with a NaN has no triangles, unless the surface is closed: NaN is then outside.
///
///   points  values at the points of active.box(), x fastest; those of the active ones are read, others may
///           be replaced
///   active  activity of the closed box of a brick, root corners included. A prefix of it gives the surface
///           of the prefix
///
/// REQUIRES: active.box() has fewer than 2^28 points; the level is finite.
template <class T>
BrickSurface surface_of_brick(std::span<T> points, const LatticeBits& active, const SurfaceGrid& grid,
                              const SurfaceLevel& level);

/// The most heap that surface_of_brick() takes for a brick of `size` points, its result included, whatever
/// the values.
std::uint64_t working_bytes_of_surface(SampleType type, Index3 size, int cube_size);

/// The most vertices and triangles that the surface in a brick of `size` points has.
std::uint64_t most_surface_vertices(Index3 size);
std::uint64_t most_surface_triangles(Index3 size);

}  // namespace tagrid
