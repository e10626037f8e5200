// The lattice of a volume, its root cubes, its bricks, and rows and runs of bricks.
#pragma once

#include <cassert>
#include <cstdint>
#include <vector>

#include "stages/grid/box.h"

namespace tagrid {

/// A volume of `dims` samples, covered by complete root cubes of edge `cube_size`. The domain is the smallest
/// lattice of complete root cubes that begins `lead` steps before the first sample and holds every sample,
/// with at least one cube along each axis.
///
/// Everything that works on the lattice, on bricks or on boxes of samples counts from the first plane of the
/// domain: sample i is the lattice point first() + i. Samples are counted from 0 only where they leave or
/// enter the program: by sources and sinks of volumes, in what callers name, and in the world.
struct Domain {
  Index3 dims;
  int cube_size = 32;
  /// 0 or 1. With 1, a brick owns as many samples as its edge has, since its low faces belong to padding or to
  /// bricks before it. An axis with one sample has no lead: its plane stays a face of root cubes.
  int lead = 0;

  /// The lattice point of the first sample.
  constexpr Index3 first() const {
    return {dims.x > 1 ? lead : 0, dims.y > 1 ? lead : 0, dims.z > 1 ? lead : 0};
  }
  constexpr std::int64_t cubes(int axis) const {
    const std::int64_t edges = first()[axis] + dims[axis] - 1;
    return edges <= 0 ? 1 : (edges + cube_size - 1) / cube_size;
  }
  /// The samples.
  constexpr Box volume() const { return Box::of_size(dims).moved(first()); }
  /// The samples of a box of lattice points, counted from 0, and the other way round.
  constexpr Box samples_at(const Box& points) const { return points.moved(-1 * first()); }
  constexpr Box points_of(const Box& samples) const { return samples.moved(first()); }
  /// All lattice points, padding included.
  constexpr Box padded() const { return {{0, 0, 0}, cube_size * Index3{cubes(0), cubes(1), cubes(2)}}; }
};

/// Number of lattice points of level 0 .. l of the padded domain, for every l up to 3K.
inline std::vector<std::uint64_t> points_up_to_level(const Domain& domain) {
  std::uint64_t m[3];  // cubes along each axis, of the edge of this cycle
  for (int axis = 0; axis < 3; ++axis) m[axis] = static_cast<std::uint64_t>(domain.cubes(axis));
  std::vector<std::uint64_t> points{(m[0] + 1) * (m[1] + 1) * (m[2] + 1)};
  for (int edge = domain.cube_size; edge > 1; edge /= 2) {
    const std::uint64_t face_centres =
        (m[0] + 1) * m[1] * m[2] + m[0] * (m[1] + 1) * m[2] + m[0] * m[1] * (m[2] + 1);
    points.push_back(points.back() + m[0] * m[1] * m[2]);  // cube centres
    points.push_back(points.back() + face_centres);
    for (std::uint64_t& cubes : m) cubes *= 2;
    points.push_back((m[0] + 1) * (m[1] + 1) * (m[2] + 1));
  }
  return points;
}

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

  /// The position along any one axis of the brick that owns the samples at this coordinate of the lattice;
  /// see owned_box().
  constexpr std::int64_t owner(std::int64_t coordinate) const {
    return coordinate == 0 ? 0 : (coordinate - 1) / length();
  }

  /// The samples that a brick owns: (low, high] of its closed box, clipped to the volume; the first brick
  /// along an axis also owns the low face, which is padding if the domain has a lead. Never empty; every
  /// sample has one owner.
  constexpr Box owned_box(Index3 position) const {
    Box box = closed_box(position);
    for (int axis = 0; axis < 3; ++axis)
      if (position[axis] > 0) ++box.low[axis];
    return intersection(box, domain.volume());
  }
};

/// Rows y_low .. y_end - 1 of the layers z_low .. z_end - 1. Rows that are read or written as one stretch of
/// a file have one layer, or all rows of each layer: so their bricks are consecutive.
struct BrickRows {
  std::int64_t y_low = 0, y_end = 0;
  std::int64_t z_low = 0, z_end = 0;

  static constexpr BrickRows all(const BrickGrid& bricks) {
    return {0, bricks.bricks(1), 0, bricks.bricks(2)};
  }

  constexpr std::int64_t first_brick(const BrickGrid& bricks) const { return bricks.id({0, y_low, z_low}); }
  /// Number of bricks in one of the layers.
  constexpr std::int64_t layer_count(const BrickGrid& bricks) const {
    return (y_end - y_low) * bricks.bricks(0);
  }
  constexpr std::int64_t count(const BrickGrid& bricks) const {
    return layer_count(bricks) * (z_end - z_low);
  }
  /// The samples that their bricks own, as points of the lattice.
  constexpr Box owned(const BrickGrid& bricks) const {
    return {bricks.owned_box({0, y_low, z_low}).low,
            bricks.owned_box({bricks.bricks(0) - 1, y_end - 1, z_end - 1}).high};
  }
  friend constexpr bool operator==(const BrickRows&, const BrickRows&) = default;
};

/// The bricks from `first` to `last`, both included.
struct BrickRun {
  std::int64_t first = 0, last = 0;
  friend constexpr bool operator==(const BrickRun&, const BrickRun&) = default;
};

/// Adds a run that begins after the others, to the last one if it follows without a gap.
inline void append(std::vector<BrickRun>& runs, const BrickRun& run) {
  if (!runs.empty() && runs.back().last == run.first - 1)
    runs.back().last = run.last;
  else
    runs.push_back(run);
}

/// The samples that the bricks of a run own, counted from 0: at most five boxes, which do not overlap.
inline std::vector<Box> boxes_of(const BrickRun& run, const BrickGrid& bricks) {
  std::vector<Box> boxes;
  // The longest stretch from `first` on that is a box: complete layers, complete rows, or a part of a row.
  for (std::int64_t first = run.first; first <= run.last;) {
    const std::int64_t left = run.last - first + 1, row = bricks.bricks(0), layer = bricks.layer_count();
    std::int64_t count = std::min(left, row - first % row);
    if (first % row == 0 && left >= row) {
      const std::int64_t of_layer = std::min(left, layer - first % layer);
      count = of_layer - of_layer % row;
    }
    if (first % layer == 0 && left >= layer) count = left - left % layer;
    boxes.push_back(bricks.domain.samples_at({bricks.owned_box(bricks.position(first)).low,
                                              bricks.owned_box(bricks.position(first + count - 1)).high}));
    first += count;
  }
  return boxes;
}

}  // namespace tagrid
