#include "io/metadata/geometry.h"

#include <algorithm>
#include <cmath>

namespace tagrid {

double determinant(const std::array<std::array<double, 3>, 3>& m) {
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
         m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

double spacing_or_1(const Geometry& geometry, std::size_t axis) {
  return std::isnan(geometry.spacing[axis]) ? 1 : geometry.spacing[axis];
}

bool has_unknown_spacing(const Geometry& geometry) {
  return std::ranges::any_of(geometry.spacing, [](double s) { return std::isnan(s); });
}

std::array<double, 3> to_world(const Geometry& geometry, const Index3& point) {
  return to_world(geometry, std::array{static_cast<double>(point.x), static_cast<double>(point.y),
                                       static_cast<double>(point.z)});
}

std::array<double, 3> to_world(const Geometry& geometry, const std::array<double, 3>& place) {
  std::array<double, 3> world = geometry.origin;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (geometry.has_directions)
      for (std::size_t i = 0; i < 3; ++i) world[i] += place[axis] * geometry.directions[axis][i];
    else
      world[axis] += place[axis] * spacing_or_1(geometry, axis);
  }
  return world;
}

bool is_mirrored(const Geometry& geometry) {
  if (geometry.has_directions) return determinant(geometry.directions) < 0;
  bool mirrored = false;
  for (double spacing : geometry.spacing) mirrored ^= spacing < 0;
  return mirrored;
}

}  // namespace tagrid
