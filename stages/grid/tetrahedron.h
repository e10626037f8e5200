// A tetrahedron of the bisection hierarchy, in exact integers.
#pragma once

#include <array>
#include <cstdint>

#include "stages/grid/box.h"

namespace tagrid {

/// Six times the signed volume: (b-a) x (c-a) . (d-a). Positive if the right-hand normal of a, b, c points
/// towards d, as in the vertex order of VTK_TETRA.
constexpr std::int64_t six_volumes(const std::array<Index3, 4>& v) {
  const Index3 p = v[1] - v[0], q = v[2] - v[0], r = v[3] - v[0];
  return p.x * (q.y * r.z - q.z * r.y) + p.y * (q.z * r.x - q.x * r.z) + p.z * (q.x * r.y - q.y * r.x);
}

constexpr std::int64_t squared_length(Index3 v) { return v.x * v.x + v.y * v.y + v.z * v.z; }

struct Tetrahedron {
  std::array<Index3, 4> vertices;  ///< six_volumes(vertices) > 0
  int level = 0;                   ///< number of bisections since the root tetrahedron, 0 .. 3K

  /// The paper's primitive: 0, 1, 2 for TYPE-I, TYPE-II, TYPE-III.
  constexpr int type() const { return level % 3; }
};

}  // namespace tagrid
