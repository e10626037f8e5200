// The lattice points of a tetrahedron.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "stages/grid/lattice.h"

namespace tagrid {

/// The smallest quotient that is not below a / b. REQUIRES: b > 0.
constexpr std::int64_t quotient_rounded_up(std::int64_t a, std::int64_t b) {
  return a / b + (a > 0 && a % b != 0);
}

/// The smallest box that holds the vertices of a tetrahedron.
constexpr Box box_around(const std::array<Index3, 4>& vertices) {
  Box around{vertices[0], vertices[0]};
  for (const Index3& v : vertices)
    for (int axis = 0; axis < 3; ++axis) {
      around.low[axis] = std::min(around.low[axis], v[axis]);
      around.high[axis] = std::max(around.high[axis], v[axis]);
    }
  return around;
}

/// Visits the lattice points of a tetrahedron in `box`, its border included, row by row: visit(p, weights), with their
/// barycentric weights, which are not negative and sum to six_volumes(vertices). Each weight is an affine function of the
/// point, and grows along a row by a constant step. REQUIRES: six_volumes(vertices) > 0.
template <class Visit>
void for_each_point_of(const std::array<Index3, 4>& vertices, const Box& box, Visit visit) {
  const Box around = intersection(box_around(vertices), box);
  const auto weights_at = [&](Index3 p) {
    std::array<std::int64_t, 4> weights;
    for (std::size_t i = 0; i < 4; ++i) {
      auto part = vertices;
      part[i] = p;
      weights[i] = six_volumes(part);
    }
    return weights;
  };
  std::array<std::int64_t, 4> step = weights_at(unit_vector(0));
  const std::array<std::int64_t, 4> origin = weights_at({0, 0, 0});
  for (std::size_t i = 0; i < 4; ++i) step[i] -= origin[i];
  for (std::int64_t z = around.low.z; z <= around.high.z; ++z)
    for (std::int64_t y = around.low.y; y <= around.high.y; ++y) {
      std::array<std::int64_t, 4> weights = weights_at({around.low.x, y, z});
      // The range of steps along the row in which no weight is negative.
      std::int64_t first = 0, last = around.high.x - around.low.x;
      for (std::size_t i = 0; i < 4; ++i) {
        if (step[i] > 0) first = std::max(first, quotient_rounded_up(-weights[i], step[i]));
        if (step[i] < 0) last = std::min(last, weights[i] < 0 ? -1 : weights[i] / -step[i]);
        if (step[i] == 0 && weights[i] < 0) last = -1;
      }
      for (std::size_t i = 0; i < 4; ++i) weights[i] += first * step[i];
      for (std::int64_t x = first; x <= last; ++x) {
        visit(Index3{around.low.x + x, y, z}, weights);
        for (std::size_t i = 0; i < 4; ++i) weights[i] += step[i];
      }
    }
}

}  // namespace tagrid
