// Dihedral angles, by which the quality of tetrahedra is judged.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace tagrid {

struct AngleRange {
  double smallest = 180, largest = 0;  ///< degrees

  void add(const AngleRange& other) {
    smallest = std::min(smallest, other.smallest);
    largest = std::max(largest, other.largest);
  }
};

/// The cosines of the smallest and of the largest dihedral angle of a tetrahedron; 2 and -2 if it is flat or
/// its vertices are not in positive order.
inline std::array<double, 2> dihedral_cosines(const std::array<std::array<double, 3>, 4>& v) {
  using Vector = std::array<double, 3>;
  const auto minus = [](const Vector& a, const Vector& b) {
    return Vector{a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  };
  const auto dot_of = [](const Vector& a, const Vector& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  };
  const auto cross_of = [](const Vector& a, const Vector& b) {
    return Vector{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  };
  if (!(dot_of(minus(v[1], v[0]), cross_of(minus(v[2], v[0]), minus(v[3], v[0]))) > 0)) return {2, -2};
  // Normals of the faces opposite to the vertices, outwards.
  constexpr std::array<std::array<std::size_t, 3>, 4> faces = {{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};
  std::array<Vector, 4> normals;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& f = faces[i];
    normals[i] = cross_of(minus(v[f[1]], v[f[0]]), minus(v[f[2]], v[f[0]]));
    const double length = std::sqrt(dot_of(normals[i], normals[i]));
    for (double& c : normals[i]) c /= length;
  }
  double least = 1, most = -1;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = i + 1; j < 4; ++j) {
      const double cosine = -dot_of(normals[i], normals[j]);
      least = std::min(least, cosine);
      most = std::max(most, cosine);
    }
  return {most, least};
}

/// The larger one of the cosines of the smallest angle and of 180 degrees minus the largest one: a measure of badness
/// without trigonometric functions, which could differ between machines. 2 if the tetrahedron is flat.
inline double largest_cosine(const std::array<std::array<double, 3>, 4>& v) {
  const auto [smallest, largest] = dihedral_cosines(v);
  return std::max(smallest, -largest);
}

/// The smallest and the largest dihedral angle; 0 and 180 degrees if the tetrahedron is flat or its vertices are not in
/// positive order.
inline AngleRange dihedral_angles(const std::array<std::array<double, 3>, 4>& v) {
  constexpr double degrees = 180 / std::numbers::pi;
  const auto [smallest, largest] = dihedral_cosines(v);
  return {std::acos(std::min(smallest, 1.0)) * degrees, std::acos(std::max(largest, -1.0)) * degrees};
}

}  // namespace tagrid
