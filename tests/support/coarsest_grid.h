// The oracle of coarsening: the whole volume in memory, every leaf tested again in every round, each sample by itself, from
// the definition and without regard for time. For samples of integers.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "stages/grid/brick_grid.h"
#include "stages/grid/lattice_bits.h"
#include "stages/mesh/cut.h"
#include "stages/mesh/tetrahedra.h"
#include "tests/support/oracle.h"
#include "tests/support/points.h"

namespace tagrid::oracle {

using Corners = std::array<Index3, 4>;

/// The barycentric weights of a point, times the six volumes.
inline std::array<std::int64_t, 4> weights_of(const Corners& corners, Index3 p) {
  std::array<std::int64_t, 4> weights;
  for (std::size_t i = 0; i < 4; ++i) {
    Corners part = corners;
    part[i] = p;
    weights[i] = six_volumes(part);
  }
  return weights;
}

/// Calls see(error, whole) for every sample of the volume in a leaf of its mesh: the distance from the mesh is the
/// quotient.
template <class T, class See>
void for_each_error_in(const Volume<T>& volume, const Tetrahedron& leaf, bool padded, See see) {
  const Box samples = volume.box();
  const auto value_at = [&](Index3 p) {  // of the field, rounded; halves up
    const std::int64_t whole = six_volumes(leaf.vertices);
    std::int64_t sum = 0;
    const auto weights = weights_of(leaf.vertices, p);
    for (std::size_t i = 0; i < 4; ++i) sum += weights[i] * std::int64_t{volume.at(leaf.vertices[i])};
    return static_cast<std::int64_t>(
        std::floor(static_cast<long double>(2 * sum + whole) / static_cast<long double>(2 * whole)));
  };
  const auto look_at = [&](const Corners& corners) {
    Box around{corners[0], corners[0]};
    for (const Index3& c : corners)
      for (int axis = 0; axis < 3; ++axis) {
        around.low[axis] = std::min(around.low[axis], c[axis]);
        around.high[axis] = std::max(around.high[axis], c[axis]);
      }
    around = intersection(around, samples);
    std::array<std::int64_t, 4> values;
    for (std::size_t i = 0; i < 4; ++i) values[i] = value_at(corners[i]);
    for (const auto [x, y, z] : points_of(around)) {
      const auto weights = weights_of(corners, {x, y, z});
      if (*std::min_element(weights.begin(), weights.end()) < 0) continue;
      std::int64_t difference = 0;
      for (std::size_t i = 0; i < 4; ++i)
        difference += weights[i] * (values[i] - std::int64_t{volume.at({x, y, z})});
      see(std::abs(difference), six_volumes(corners));
    }
  };
  if (padded || !reaches_beyond(leaf.vertices, samples)) return look_at(leaf.vertices);
  for (const Corners& piece : cut_at(leaf.vertices, samples)) look_at(piece);
}

/// True if a sample in the leaf is further from the mesh than `bound`, a multiple of 1/1024.
template <class T>
bool violates(const Volume<T>& volume, const Tetrahedron& leaf, double bound, bool padded) {
  const auto parts = static_cast<std::int64_t>(bound * 1024);
  bool violated = false;
  for_each_error_in(volume, leaf, padded, [&](std::int64_t error, std::int64_t whole) {
    violated = violated || static_cast<__int128>(error) * 1024 > static_cast<__int128>(parts) * whole;
  });
  return violated;
}

/// The midpoint of the longest edge.
inline Index3 split_of(const Tetrahedron& t) {
  Index3 longest{}, sum{};
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (const Index3 d = t.vertices[i] - t.vertices[j]; squared_length(d) > squared_length(longest)) {
        longest = d;
        sum = t.vertices[i] + t.vertices[j];
      }
  return {sum.x / 2, sum.y / 2, sum.z / 2};
}

template <class T>
bool any_leaf_violates(const Volume<T>& volume, const LatticeBits& active, int cube_size, double bound,
                       bool padded) {
  bool violated = false;
  for_each_leaf_tetrahedron(
      active, active.box(), cube_size, max_level(cube_size),
      [&](const Tetrahedron& leaf) { violated = violated || violates(volume, leaf, bound, padded); });
  return violated;
}

/// The smallest closed set of points, with those of `active`, whose leaves do not violate the bound.
template <class T>
LatticeBits coarsest_grid(const Volume<T>& volume, int cube_size, double bound, bool padded,
                          LatticeBits active = {}) {
  if (active.box().empty()) active = LatticeBits(volume.domain(cube_size).padded());
  for (;;) {
    oracle::close_under_parents(active, cube_size);
    std::vector<Index3> splits;
    for_each_leaf_tetrahedron(active, active.box(), cube_size, max_level(cube_size),
                              [&](const Tetrahedron& leaf) {
                                if (violates(volume, leaf, bound, padded)) splits.push_back(split_of(leaf));
                              });
    if (splits.empty()) return active;
    for (const Index3 p : splits) active.set(p);
  }
}

}  // namespace tagrid::oracle
