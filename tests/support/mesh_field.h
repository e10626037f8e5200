// Computes the field of a mesh at lattice points from nothing but the mesh: each point is searched for in the
// tetrahedra.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "tests/support/mesh_laws.h"
#include "tests/support/points.h"

namespace tagrid {

/// Calls visit(p, weights, six) for every lattice point p of `box` in every tetrahedron that contains it. The
/// value at p is the sum of the weights times the values of the vertices, divided by `six`, the six volumes
/// of the tetrahedron.
template <class Visit>
void for_each_point_in_mesh(const LatticeMesh& mesh, const Box& box, Visit visit) {
  for (std::size_t t = 0; t < mesh.size(); ++t) {
    const auto v = mesh.vertices(t);
    Box around{v[0], v[0]};
    for (Index3 p : v)
      for (int axis = 0; axis < 3; ++axis) {
        around.low[axis] = std::min(around.low[axis], p[axis]);
        around.high[axis] = std::max(around.high[axis], p[axis]);
      }
    around = intersection(around, box);
    for (const auto [x, y, z] : points_of(around)) {
      std::array<std::int64_t, 4> weights;
      bool inside = true;
      for (std::size_t i = 0; i < 4; ++i) {
        auto part = v;
        part[i] = {x, y, z};
        weights[i] = six_volumes(part);
        inside = inside && weights[i] >= 0;
      }
      if (inside) visit(Index3{x, y, z}, t, weights, six_volumes(v));
    }
  }
}

/// A value of the field as a fraction.
struct Fraction {
  std::int64_t sum = 0, whole = 0;

  /// The nearest whole number, halves up.
  std::int64_t rounded() const {
    const std::int64_t twice = 2 * sum + whole;
    return twice / (2 * whole) - (twice % (2 * whole) < 0);
  }
};

/// The field of integer `values` at the points of `box`, x fastest. A point in no tetrahedron has a whole of
/// 0. `disagree` counts points at which two tetrahedra have different values.
template <class T>
std::vector<Fraction> field_of_mesh(const LatticeMesh& mesh, const std::vector<T>& values, const Box& box,
                                    std::int64_t& disagree) {
  std::vector<Fraction> field(static_cast<std::size_t>(box.count()));
  for_each_point_in_mesh(mesh, box, [&](Index3 p, std::size_t t, const auto& weights, std::int64_t six) {
    Fraction here{0, six};
    for (std::size_t i = 0; i < 4; ++i)
      here.sum += weights[i] * static_cast<std::int64_t>(values[static_cast<std::size_t>(mesh.ids(t)[i])]);
    Fraction& there = field[static_cast<std::size_t>(box.offset(p))];
    disagree += there.whole != 0 && static_cast<__int128>(there.sum) * here.whole !=
                                        static_cast<__int128>(here.sum) * there.whole;
    there = here;
  });
  return field;
}

}  // namespace tagrid
