// The body-centered cubic lattice of a mesh with materials: the corners and the centers of cubes of edge H.
//
// Lattice points count in halves of H, so that both are points: corners have even coordinates, centers have odd
// ones. Neighbors are joined by edges of two lengths: half a diagonal of a cube ("short", between a corner and a
// center), and H ("long", between two corners or two centers). Four tetrahedra surround each long edge; all
// tetrahedra are alike, with dihedral angles of 60 and 90 degrees.
#pragma once

#include <array>
#include <cassert>
#include <compare>
#include <cstddef>
#include <cstdint>

#include "stages/grid/box.h"

namespace tagrid {

/// An edge leaves its lower end (in raster order) in one of these directions: 4 short ones, 3 long ones.
inline constexpr std::array<Index3, 7> edge_directions = {
    {{-1, -1, 1}, {1, -1, 1}, {-1, 1, 1}, {1, 1, 1}, {2, 0, 0}, {0, 2, 0}, {0, 0, 2}}};
inline constexpr int first_long_edge = 4, edges_of_point = 7;

/// 0 for short edges, 1 for long ones.
constexpr int length_class(int edge) { return edge < first_long_edge ? 0 : 1; }
/// Squares of the lengths, in halves of H.
inline constexpr std::array<std::int64_t, 2> squared_lengths = {3, 4};

/// True if `a` comes before `b` in raster order.
constexpr bool is_before(Index3 a, Index3 b) {
  return a.z != b.z ? a.z < b.z : a.y != b.y ? a.y < b.y : a.x < b.x;
}

/// The edge between a point and the point in this direction, which may be the opposite of one of edge_directions; -1
/// for others, such as diagonals of faces of cubes, which are never cut.
constexpr int edge_of_direction(Index3 d) {
  if (d.z < 0 || (d.z == 0 && (d.y < 0 || (d.y == 0 && d.x < 0)))) d = -1 * d;
  if (d.x != 0 && d.y != 0 && d.z != 0) return (d.x > 0 ? 1 : 0) + (d.y > 0 ? 2 : 0);
  const int zeros = (d.x == 0) + (d.y == 0) + (d.z == 0);
  return zeros != 2 ? -1 : d.x != 0 ? 4 : d.y != 0 ? 5 : 6;
}

constexpr bool is_edge_of_every_direction_found() {
  for (int e = 0; e < edges_of_point; ++e)
    if (edge_of_direction(edge_directions[static_cast<std::size_t>(e)]) != e) return false;
  return true;
}
static_assert(is_edge_of_every_direction_found());

/// A vertex of a mesh: a point of the lattice, or the cut of the edge that leaves the point in a direction.
struct MeshVertex {
  Index3 point;
  int edge = -1;  ///< -1 for the point itself

  friend constexpr bool operator==(const MeshVertex&, const MeshVertex&) = default;
};

/// The points of the lattice in a box whose corners are corners of cubes, as numbers from 0.
class BccBox {
 public:
  BccBox() = default;
  /// REQUIRES: all coordinates are even; the box is not empty.
  explicit BccBox(const Box& box)
      : box_(box),
        size_{(box.high.x - box.low.x) / 2 + 1, (box.high.y - box.low.y) / 2 + 1,
              (box.high.z - box.low.z) / 2 + 1} {
    assert(((box.low.x | box.low.y | box.low.z | box.high.x | box.high.y | box.high.z) & 1) == 0);
  }

  const Box& box() const { return box_; }
  /// One more than the largest number. Centers beyond the high faces have numbers, too.
  std::size_t count() const { return static_cast<std::size_t>(2 * size_.x * size_.y * size_.z); }
  /// REQUIRES: the box contains p; its coordinates are all even or all odd.
  std::size_t number(Index3 p) const {
    assert(box_.contains(p) && ((p.x ^ p.y) & 1) == 0 && ((p.x ^ p.z) & 1) == 0);
    const Index3 d = p - box_.low;
    return static_cast<std::size_t>(2 * (((d.z >> 1) * size_.y + (d.y >> 1)) * size_.x + (d.x >> 1)) +
                                    (d.x & 1));
  }
  /// How far number() grows along an edge.
  std::int64_t step(Index3 from, Index3 direction) const {
    return static_cast<std::int64_t>(number(from + direction)) - static_cast<std::int64_t>(number(from));
  }

 private:
  Box box_{{0, 0, 0}, {-2, -2, -2}};
  Index3 size_;
};

/// Calls visit(Index3) for the points of the lattice in a box, corners first.
template <class Visit>
void for_each_bcc_point(const Box& box, Visit visit) {
  for (std::int64_t parity = 0; parity < 2; ++parity) {
    Index3 low;
    for (int axis = 0; axis < 3; ++axis) low[axis] = box.low[axis] + ((box.low[axis] ^ parity) & 1);
    for_each_point_of({low, box.high}, 2, visit);
  }
}

}  // namespace tagrid
