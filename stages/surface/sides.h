// What the march knows of the points of a brick. A vertex of exactly the level is tested together with those
// of its neighbors that are the same in every brick that has the vertex.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stages/grid/lattice.h"
#include "stages/grid/lattice_bits.h"
#include "stages/mesh/tetrahedra.h"
#include "stages/surface/surface.h"

namespace tagrid {

/// Of a vertex inside of a root cube, all vertices with which it shares a leaf; of one on a face or an edge
/// of root cubes, those in the plane of the face or on the line of the edge; of a corner, none. All root
/// cubes at a vertex have these in common.
class CommonNeighbours {
 public:
  /// `active` must outlive the object. A prefix of the activity gives the neighbors in the prefix.
  CommonNeighbours(const LatticeBits& active, int cube_size) : active_(active), cube_size_(cube_size) {}

  /// Whether neighbors along this axis are among them.
  bool are_along(int axis, Index3 vertex) const { return vertex[axis] % cube_size_ != 0; }
  /// The number of such axes: 3 inside of a root cube, 2 on a face, 1 on an edge, 0 at a corner.
  int axes(Index3 vertex) const { return are_along(0, vertex) + are_along(1, vertex) + are_along(2, vertex); }
  bool is_vertex(Index3 p) const { return active_.test(p); }

  /// True if is_found(std::span<const Index3>) is true of any leaf at the vertex; it gets those of its other
  /// vertices that are common neighbors. Any bits are safe. REQUIRES: the box of the activity consists of
  /// complete root cubes and contains the vertex.
  template <class IsFound>
  bool any_leaf(Index3 vertex, IsFound is_found) const {
    Index3 corner;
    for (int axis = 0; axis < 3; ++axis)
      corner[axis] =
          std::min(vertex[axis] / cube_size_, active_.box().high[axis] / cube_size_ - 1) * cube_size_;
    for (const BisectionStep& root : root_tetrahedra(corner, cube_size_)) {
      // Root tetrahedra are paths along the axes, so differences of coordinates are weights.
      std::array<std::int64_t, 3> along;
      for (std::size_t i = 0; i < 3; ++i)
        along[i] = dot(vertex - corner, root.vertices[i + 1] - root.vertices[i]) / cube_size_;
      const BarycentricWeights weights{cube_size_ - along[0], along[0] - along[1], along[1] - along[2],
                                       along[2]};
      const bool contains = std::ranges::all_of(weights, [](std::int64_t w) { return w >= 0; });
      if (contains && any_below(root, weights, vertex, is_found)) return true;
    }
    return false;
  }

 private:
  template <class IsFound>
  bool any_below(const BisectionStep& step, const BarycentricWeights& weights, Index3 vertex,
                 IsFound& is_found) const {
    if (step.level == max_level(cube_size_) || !active_.test(step.midpoint())) {
      std::array<Index3, 4> common;
      const auto end = std::ranges::copy_if(step.vertices, common.begin(), [&](Index3 v) {
                         return v != vertex && is_common(v, vertex);
                       }).out;
      return is_found(std::span<const Index3>(common.begin(), end));
    }
    const Index3 middle = step.midpoint();
    const auto end = static_cast<std::size_t>(step.base_end());
    const auto any_in_half = [&](int which) {
      return any_below(step.half(middle, which), weights_in_half(weights, end, which), vertex, is_found);
    };
    return (weights[end] <= weights[0] && any_in_half(0)) || (weights[0] <= weights[end] && any_in_half(1));
  }

  bool is_common(Index3 neighbour, Index3 vertex) const {
    for (int axis = 0; axis < 3; ++axis)
      if (!are_along(axis, vertex) && neighbour[axis] != vertex[axis]) return false;
    return true;
  }

  const LatticeBits& active_;
  int cube_size_;
};

/// A byte for each point of a brick.
class Sides {
 public:
  static constexpr std::uint8_t active = 1,  ///< the point is a vertex of the grid
      inside = 2,                            ///< an active point that is inside
      border = 4,                            ///< an active point in the border of the volume
      beyond = 8,                            ///< an active point outside of the volume
      crossed = 16,  ///< the centre of a cell with active points on both sides, or at a border to be closed
      alone = 32;    ///< an active point of exactly the level that is outside; see SurfaceLevel

  /// Finds all of them. See surface_of_brick().
  template <class T>
  Sides(std::span<const T> points, const LatticeBits& active_bits, const SurfaceGrid& grid,
        const SurfaceLevel& level);

  /// The most heap that it takes while it is made.
  static std::uint64_t working_bytes(Index3 size);

  /// Of the point with that number in raster order.
  std::uint8_t operator[](std::uint32_t number) const { return of_point_[number]; }

 private:
  // The cells of one size, x fastest.
  struct Cells {
    Index3 count;
    std::vector<std::uint8_t> sides;  // 1: some active point is outside; 2: inside
  };
  template <class T>
  LatticeBits find_inside(std::span<const T> points, const LatticeBits& active_bits, const SurfaceGrid& grid,
                          const SurfaceLevel& level);
  template <class T>
  void put_outside_those_alone(std::span<const T> points, const LatticeBits& active_bits,
                               const SurfaceGrid& grid, const SurfaceLevel& level, LatticeBits& inside_bits);
  template <class T>
  bool is_alone(Index3 p, std::span<const T> points, const Box& box, const CommonNeighbours& neighbours,
                const SurfaceGrid& grid) const;
  static Cells smallest_cells(const LatticeBits& active_bits, const LatticeBits& inside_bits);
  static Cells next_cells(const Cells& smaller);
  void mark_crossed(const Cells& cells, std::int64_t edge, const Box& box, const SurfaceGrid& grid);

  std::vector<std::uint8_t> of_point_;
};

}  // namespace tagrid
