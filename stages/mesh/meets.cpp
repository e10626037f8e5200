#include "stages/mesh/meets.h"

#include <algorithm>

namespace tagrid {
namespace {

bool apart_along(Index3 normal, const std::array<Index3, 4>& vertices, const Box& box) {
  std::int64_t low = dot(normal, vertices[0]), high = low;
  for (const Index3& v : vertices) {
    low = std::min(low, dot(normal, v));
    high = std::max(high, dot(normal, v));
  }
  std::int64_t box_low = 0, box_high = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t a = normal[axis] * box.low[axis], b = normal[axis] * box.high[axis];
    box_low += std::min(a, b);
    box_high += std::max(a, b);
  }
  return box_high < low || high < box_low;
}

}  // namespace

bool meets(const std::array<Index3, 4>& given, const Box& given_box) {
  Box bounds = {given[0], given[0]};
  for (const Index3& v : given)
    for (int axis = 0; axis < 3; ++axis) {
      bounds.low[axis] = std::min(bounds.low[axis], v[axis]);
      bounds.high[axis] = std::max(bounds.high[axis], v[axis]);
    }
  // Only what lies in the tetrahedron's own box matters. Coordinates relative to its corner are small.
  Box box = intersection(bounds, given_box);
  if (box.empty()) return false;
  box = {box.low - bounds.low, box.high - bounds.low};
  std::array<Index3, 4> vertices;
  for (std::size_t i = 0; i < 4; ++i) vertices[i] = given[i] - bounds.low;

  for (std::size_t i = 0; i < 4; ++i) {
    const Index3 a = vertices[(i + 1) % 4], b = vertices[(i + 2) % 4], c = vertices[(i + 3) % 4];
    if (apart_along(cross(b - a, c - a), vertices, box)) return false;
    for (std::size_t j = 0; j < i; ++j)
      for (int axis = 0; axis < 3; ++axis)
        if (apart_along(cross(vertices[i] - vertices[j], unit_vector(axis)), vertices, box)) return false;
  }
  return true;
}

}  // namespace tagrid
