// The lattice of a volume, its root cubes and its bricks.
#pragma once

#include <cassert>
#include <cstdint>
#include <vector>

#include "stages/grid/box.h"

namespace tagrid {

/// A volume of `dims` samples, covered by complete root cubes of edge `cube_size`. The domain is the smallest
/// lattice of complete root cubes that holds every sample, with at least one cube along each axis.
struct Domain {
  Index3 dims;
  int cube_size = 32;

  constexpr std::int64_t cubes(int axis) const {
    const std::int64_t edges = dims[axis] - 1;
    return edges <= 0 ? 1 : (edges + cube_size - 1) / cube_size;
  }
  /// The samples.
  constexpr Box volume() const { return Box::of_size(dims); }
  /// All lattice points, padding included.
  constexpr Box padded() const { return {{0, 0, 0}, cube_size * Index3{cubes(0), cubes(1), cubes(2)}}; }
};

/// Number of lattice points of level 0 .. l of the padded domain, for every l up to 3K.
std::vector<std::uint64_t> points_up_to_level(const Domain& domain);

/// The domain cut into bricks of `edge` root cubes along each axis; the last brick along an axis may have
/// fewer. Bricks are numbered in raster order, x fastest.
struct BrickGrid {
  Domain domain;
  int edge = 2;  ///< root cubes

  /// The edge of a brick in samples.
  constexpr std::int64_t length() const { return std::int64_t{edge} * domain.cube_size; }
  constexpr std::int64_t bricks(int axis) const { return (domain.cubes(axis) + edge - 1) / edge; }
  constexpr std::int64_t count() const { return bricks(0) * bricks(1) * bricks(2); }
  constexpr std::int64_t layer_count() const { return bricks(0) * bricks(1); }

  constexpr Index3 position(std::int64_t id) const {
    return {id % bricks(0), id / bricks(0) % bricks(1), id / layer_count()};
  }
  constexpr std::int64_t id(Index3 position) const {
    return (position.z * bricks(1) + position.y) * bricks(0) + position.x;
  }

  /// All lattice points of a brick, including the faces that it shares with its neighbors.
  constexpr Box closed_box(Index3 position) const {
    Box box;
    for (int axis = 0; axis < 3; ++axis) {
      box.low[axis] = position[axis] * length();
      box.high[axis] = std::min(box.low[axis] + length(), domain.cubes(axis) * domain.cube_size);
    }
    return box;
  }

  /// The position along any one axis of the brick that owns the samples at this coordinate; see owned_box().
  constexpr std::int64_t owner(std::int64_t coordinate) const {
    return coordinate == 0 ? 0 : (coordinate - 1) / length();
  }

  /// The samples that a brick owns: (low, high] of its closed box, clipped to the volume; the first brick
  /// along an axis also owns the low face. Never empty; every sample has one owner.
  constexpr Box owned_box(Index3 position) const {
    Box box = closed_box(position);
    for (int axis = 0; axis < 3; ++axis)
      if (position[axis] > 0) ++box.low[axis];
    return intersection(box, domain.volume());
  }
};

}  // namespace tagrid
