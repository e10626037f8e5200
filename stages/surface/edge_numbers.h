// Numbers the edges of a grid that a surface crosses.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "stages/surface/packed_point.h"

namespace tagrid {

/// A set of edges, which are numbered in the raster order of their midpoints. In a conforming mesh no two edges have
/// the same midpoint, and no vertex lies on one. So the sum of its ends, which is a point of the lattice with half the
/// distances, names an edge; and twice a vertex names the vertex.
class EdgeNumbers {
 public:
  /// Edges in a box of `size` points, fewer than 2^28.
  explicit EdgeNumbers(Index3 size)
      : order_(doubled(size)),
        edges_(static_cast<std::size_t>(Box::of_size(doubled(size)).count() + 63) / 64) {}

  static std::uint64_t working_bytes(Index3 size) {
    const auto words = static_cast<std::uint64_t>(Box::of_size(doubled(size)).count() + 63) / 64;
    return words * (sizeof(std::uint64_t) + sizeof(std::uint32_t));
  }

  void add(PackedPoint sum_of_ends) {
    const std::uint32_t bit = order_.number(sum_of_ends);
    edges_[bit / 64] |= std::uint64_t{1} << (bit % 64);
  }

  /// Gives the edges their numbers. Returns how many they are. To be called once, after the last add().
  std::size_t count() {
    before_.reserve(edges_.size());
    std::uint32_t sum = 0;
    for (const std::uint64_t word : edges_) {
      before_.push_back(sum);
      sum += static_cast<std::uint32_t>(std::popcount(word));
    }
    return sum;
  }

  /// REQUIRES: the edge was added; count() was called.
  std::uint32_t number(PackedPoint sum_of_ends) const {
    const std::uint32_t bit = order_.number(sum_of_ends);
    const std::uint64_t lower = edges_[bit / 64] & ((std::uint64_t{1} << (bit % 64)) - 1);
    return before_[bit / 64] + static_cast<std::uint32_t>(std::popcount(lower));
  }

 private:
  static constexpr Index3 doubled(Index3 size) { return 2 * size - Index3{1, 1, 1}; }

  RasterOrder order_;                  // of the lattice with half the distances
  std::vector<std::uint64_t> edges_;   // a bit for each of its points
  std::vector<std::uint32_t> before_;  // for each word, the edges in the words before it
};

}  // namespace tagrid
