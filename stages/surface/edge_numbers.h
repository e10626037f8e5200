// Points of a brick as single numbers, and numbers of the edges that a surface crosses.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stages/grid/box.h"
#include "stages/sample/vector_code.h"

namespace tagrid {

/// A point of a brick: its number in raster order in the upper half; in the lower half, half of its number in
/// the raster order of the lattice with half the distances. Both are linear in the coordinates. So the sum of
/// two such numbers is that of the points, and half of it is the point in their middle, if that is a lattice
/// point.
using BrickPoint = std::uint64_t;

/// The place of a point among the points of the brick, x fastest.
constexpr std::uint32_t number_of(BrickPoint p) { return static_cast<std::uint32_t>(p >> 32); }

/// The place of the middle of two points in the lattice with half the distances.
constexpr std::uint32_t number_of_middle(BrickPoint a, BrickPoint b) {
  return static_cast<std::uint32_t>(a + b);
}

constexpr Index3 doubled_lattice(Index3 size) { return 2 * size - Index3{1, 1, 1}; }

/// Converts the points of a brick of `size` points, of which there are fewer than 2^28. Points are relative
/// to its low corner.
class BrickPoints {
 public:
  explicit BrickPoints(Index3 size) : size_(size) {
    const Index3 doubled = doubled_lattice(size);
    row_ = joined(size.x, doubled.x);
    slice_ = joined(size.x * size.y, doubled.x * doubled.y);
  }

  BrickPoint point(Index3 p) const {
    return static_cast<BrickPoint>(p.x) * joined(1, 1) + static_cast<BrickPoint>(p.y) * row_ +
           static_cast<BrickPoint>(p.z) * slice_;
  }
  Index3 operator[](BrickPoint p) const {
    const auto number = static_cast<std::int64_t>(number_of(p)), row = number / size_.x;
    return {number % size_.x, row % size_.y, row / size_.y};
  }

 private:
  static constexpr BrickPoint joined(std::int64_t upper, std::int64_t lower) {
    return static_cast<BrickPoint>(upper) << 32 | static_cast<BrickPoint>(lower);
  }

  Index3 size_;
  BrickPoint row_ = 0, slice_ = 0;  // the steps along y and z
};

/// A set of edges, which are numbered in the raster order of their midpoints. In a conforming mesh no two
/// edges have the same midpoint, and no vertex lies on one. So the sum of its ends, which is a point of the
/// lattice with half the distances, names an edge; and twice a vertex names the vertex.
class EdgeNumbers {
 public:
  /// Edges in a box of `size` points, fewer than 2^28. An edge is given by its number_of_middle().
  explicit EdgeNumbers(Index3 size) : edges_(words(size)) {}

  static std::uint64_t working_bytes(Index3 size) {
    return words(size) * (2 * sizeof(std::uint64_t) + sizeof(std::uint32_t));
  }

  void add(std::uint32_t middle) { edges_[middle / 64] |= std::uint64_t{1} << (middle % 64); }

  /// Gives the edges their numbers. Returns how many they are. To be called once, after the last add().
  std::size_t count() {
    before_.reserve(edges_.size());
    std::uint32_t sum = 0;
    for (const std::uint64_t word : edges_) {
      before_.push_back(sum);
      sum += static_cast<std::uint32_t>(std::popcount(word));
    }
    asked_for_ = edges_;
    return sum;
  }

  /// True at the first call for this edge. REQUIRES: the edge was added; count() was called.
  bool is_first(std::uint32_t middle) {
    const std::uint64_t bit = std::uint64_t{1} << (middle % 64);
    std::uint64_t& word = asked_for_[middle / 64];
    const bool first = (word & bit) != 0;
    word &= ~bit;
    return first;
  }

  /// REQUIRES: the edge was added; count() was called.
  std::uint32_t number(std::uint32_t middle) const {
    return number_in(edges_.data(), before_.data(), middle);
  }
  /// Replaces the edges of triangles by their numbers. REQUIRES: as for number().
  void replace_by_numbers(std::span<std::array<std::uint32_t, 3>> triangles) const {
    replace(edges_.data(), before_.data(), triangles);
  }

 private:
  static std::size_t words(Index3 size) {
    return static_cast<std::size_t>(Box::of_size(doubled_lattice(size)).count() + 63) / 64;
  }

  static TAGRID_INLINE std::uint32_t number_in(const std::uint64_t* edges, const std::uint32_t* before,
                                               std::uint32_t middle) {
    const std::uint64_t lower = edges[middle / 64] & ((std::uint64_t{1} << (middle % 64)) - 1);
    return before[middle / 64] + static_cast<std::uint32_t>(std::popcount(lower));
  }
  static void replace(const std::uint64_t* edges, const std::uint32_t* before,
                      std::span<std::array<std::uint32_t, 3>> triangles);

  std::vector<std::uint64_t> edges_;      // a bit for each point of the lattice with half the distances
  std::vector<std::uint64_t> asked_for_;  // bits of edges for which is_first() was not called
  std::vector<std::uint32_t> before_;     // for each word, the edges in the words before it
};

}  // namespace tagrid
