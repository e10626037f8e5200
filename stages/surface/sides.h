// What the march knows of the points of a brick.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "stages/grid/lattice_bits.h"
#include "stages/surface/common_neighbours.h"
#include "stages/surface/surface.h"

namespace tagrid {

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
