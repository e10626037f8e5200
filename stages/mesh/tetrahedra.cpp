#include "stages/mesh/tetrahedra.h"

#include <algorithm>
#include <array>
#include <utility>

namespace tagrid {
namespace {

/// A point of a root cube as one number, relative to the cube's low corner: 16 bits each for x, y and z. The
/// sum of two points is the sum of their numbers, and so is half of it if all coordinates are even: no bit
/// crosses over.
using Packed = std::uint64_t;

constexpr Packed packed(Index3 p) {
  return static_cast<Packed>(p.x) | static_cast<Packed>(p.y) << 16 | static_cast<Packed>(p.z) << 32;
}
constexpr Index3 unpacked(Packed p) {
  return {static_cast<std::int64_t>(p & 0xffff), static_cast<std::int64_t>(p >> 16 & 0xffff),
          static_cast<std::int64_t>(p >> 32)};
}

/// The tetrahedron of a BisectionStep, and a place in it.
struct Descent {
  std::array<Packed, 4> vertices;
  BarycentricWeights weights;
  bool negative = false;
  int level = 0;

  template <int end>
  Packed middle() const {
    return (vertices[0] + vertices[end]) >> 1;
  }
  /// Goes to the half that contains the place, half 0 if both do; the vertices are those of
  /// BisectionStep::half().
  template <int end>
  void bisect(Packed middle) {
    if (weights[end] <= weights[0]) {
      weights = weights_in_half(weights, end, 0);
    } else {
      for (int i = 0; i < end; ++i) vertices[i] = vertices[i + 1];
      weights = weights_in_half(weights, end, 1);
      negative = negative != (end % 2 == 1);
    }
    vertices[end] = middle;
    ++level;
  }
};

// The low corner of the root cube that contains the place; of the last one in the box at its high end.
Index3 corner_of_cube(const Box& box, const Place& place, int cube_size) {
  Index3 corner;
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t length = place.parts * cube_size;
    corner[axis] = std::min(place.numerators[axis] / length, box.high[axis] / cube_size - 1) * cube_size;
  }
  return corner;
}

// A root tetrahedron is the path along the axes in one order, and holds the places whose coordinates in the
// cube decrease in that order.
Descent root_at(const Place& place, Index3 corner, int cube_size) {
  const Index3 inside = place.numerators - place.parts * corner;
  std::array<int, 3> order = {0, 1, 2};
  if (inside[order[0]] < inside[order[1]]) std::swap(order[0], order[1]);
  if (inside[order[1]] < inside[order[2]]) std::swap(order[1], order[2]);
  if (inside[order[0]] < inside[order[1]]) std::swap(order[0], order[1]);
  const std::int64_t a = inside[order[0]], b = inside[order[1]], c = inside[order[2]];
  const Packed first = packed(cube_size * unit_vector(order[0])),
               second = first + packed(cube_size * unit_vector(order[1]));
  // As in root_tetrahedra(): the path along x, y and z and its rotations are positive.
  const bool negative = (order[1] - order[0] + 3) % 3 != 1;
  return {{0, first, second, packed(cube_size * Index3{1, 1, 1})},
          {place.parts * cube_size - a, a - b, b - c, c},
          negative};
}

// Bisects at the base edge that ends in vertex `end`, unless its midpoint is inactive.
template <int end>
bool bisect_if_active(const LatticeBits& active, Index3 corner, Descent& descent) {
  const Packed middle = descent.middle<end>();
  if (!active.test(corner + unpacked(middle))) return false;
  descent.bisect<end>(middle);
  return true;
}

}  // namespace

BisectionStep leaf_at(const LatticeBits& active, const Place& place, int cube_size) {
  const Index3 corner = corner_of_cube(active.box(), place, cube_size);
  Descent descent = root_at(place, corner, cube_size);
  // The ends of base edges are those of BisectionStep::base_end().
  const int deepest = max_level(cube_size);
  while (descent.level < deepest && bisect_if_active<3>(active, corner, descent) &&
         bisect_if_active<2>(active, corner, descent) && bisect_if_active<1>(active, corner, descent)) {
  }
  BisectionStep leaf{{}, descent.level, descent.negative};
  for (std::size_t i = 0; i < 4; ++i) leaf.vertices[i] = corner + unpacked(descent.vertices[i]);
  return leaf;
}

}  // namespace tagrid
