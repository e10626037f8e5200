// The bisection hierarchy of the paper, in exact integers.
//
// Every lattice point that is not a corner of a root cube is the midpoint of exactly one base edge. The base
// edge is the longest edge of the tetrahedra around it, which together are its diamond (the paper's region of
// influence RI(E)). So a point stands for its base edge, its diamond, and the decision to bisect there. All
// of these follow from the coordinates alone:
//
//   unit u        the largest power of two, at most S/2, for which x/u, y/u, z/u are integers; not all even
//   odd = 3       cube centre:   base edge = the body diagonal of its cell (edge 2u)   level 3N+1
//   odd = 2       face centre:   base edge = a diagonal of the face (edge 2u)          level 3N+2
//   odd = 1       edge midpoint: base edge = the axis-parallel edge of length 2u       level 3N+3
//
// where S is the edge of a root cube and 2u = S / 2^N. A diagonal joins the corner whose (in-plane)
// coordinates, in units of 2u, are all even with the corner whose coordinates are all odd. At the root, where
// 2u = S, it is (0,0,0)-(1,1,1) in every cube (the paper's pattern A).
#pragma once

#include <array>
#include <cstdint>

#include "stages/grid/box.h"

namespace tagrid {

inline constexpr int min_cube_size = 4;
inline constexpr int max_cube_size = 256;

/// Number of bisection levels of a root cube of edge S = 2^K: 3K (the paper's Eq. 1).
constexpr int max_level(int cube_size) {
  int levels = 0;
  for (int s = cube_size; s > 1; s /= 2) levels += 3;
  return levels;
}

/// The level of the points with `odd` odd coordinates in units of `unit`.
constexpr int level_of(int cube_size, std::int64_t unit, int odd) {
  return max_level(static_cast<int>(cube_size / (2 * unit))) + 4 - odd;
}

/// A list of at most 8 points that needs no allocation.
struct PointList {
  std::array<Index3, 8> points{};
  int size = 0;

  constexpr void push_back(Index3 p) { points[static_cast<std::size_t>(size++)] = p; }
  constexpr const Index3* begin() const { return points.data(); }
  constexpr const Index3* end() const { return points.data() + size; }
  constexpr const Index3& operator[](int i) const { return points[static_cast<std::size_t>(i)]; }
};

struct BaseEdge {
  Index3 left, right;
};

/// The properties of a point that follow from its coordinates.
struct PointClass {
  int odd = 0;            ///< number of odd coordinates in units of `unit`; 0 only for root corners
  std::int64_t unit = 0;  ///< u; S for root corners
  int level = 0;          ///< 0 for root corners, else 1 .. 3K
  std::array<bool, 3> is_odd{};
};

/// The class of a point of a lattice with root cubes of edge `cube_size`. Coordinates may be negative: the
/// rule is that of the unbounded lattice, which is periodic in 2S.
PointClass classify(Index3 p, int cube_size);

/// The base edge whose midpoint is `p`. REQUIRES: p is not a root corner.
BaseEdge base_edge(Index3 p, const PointClass& c, int cube_size);

/// The points that must be active before `p` can be: the midpoints of the longest edges on the border of the
/// diamond of `p`. 3 for a cube centre (none at the root), 2 for a face centre, 4 for an edge midpoint.
/// Points outside the domain are listed as well; callers ignore them.
PointList parents(Index3 p, const PointClass& c, int cube_size);

/// The points that have `p` as a parent: 6, 4 or 8; edge midpoints of unit 1 have none.
PointList children(Index3 p, const PointClass& c);

/// Six times the signed volume: (b-a) x (c-a) . (d-a). Positive if the right-hand normal of a, b, c points
/// towards d, as in the vertex order of VTK_TETRA.
constexpr std::int64_t six_volumes(const std::array<Index3, 4>& v) {
  return dot(v[1] - v[0], cross(v[2] - v[0], v[3] - v[0]));
}

constexpr std::int64_t squared_length(Index3 v) { return dot(v, v); }

struct Tetrahedron {
  std::array<Index3, 4> vertices;  ///< six_volumes(vertices) > 0
  int level = 0;                   ///< number of bisections since the root tetrahedron, 0 .. 3K

  /// The paper's primitive: 0, 1, 2 for TYPE-I, TYPE-II, TYPE-III.
  constexpr int type() const { return level % 3; }
};

/// The base edge and the vertices around it, in order. Tetrahedron i has the vertices left, right, ring[i]
/// and ring[i + 1]; the last one closes the ring. There are 6 tetrahedra around a cube centre, 4 around a
/// face centre, and 8 around an edge midpoint. Vertices outside the domain are listed as well.
struct Diamond {
  BaseEdge edge;
  PointList ring;
  int level = 0;  ///< number of bisections that made its tetrahedra: one less than the level of the point

  int size() const { return ring.size; }
  /// REQUIRES: 0 <= i < size().
  Tetrahedron tetrahedron(int i) const {
    return {{edge.left, edge.right, ring[i], ring[i + 1 == ring.size ? 0 : i + 1]}, level};
  }
};

/// The diamond of `p`, with exact integer coordinates. REQUIRES: p is not a root corner.
Diamond diamond(Index3 p, const PointClass& c, int cube_size);

}  // namespace tagrid
