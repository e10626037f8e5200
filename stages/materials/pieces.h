// The pieces of a tetrahedron that is cut at points of its edges: it is bisected at one edge after the other, in an
// order that belongs to the edges. So two tetrahedra cut their common face alike, for any number of materials and
// without a table. No piece has corners of two materials, because the edge between them would be cut; each has at
// least one of the four corners that was not snapped, if the tetrahedron has one.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tagrid {

/// The edges of a tetrahedron, by its corners 0 .. 3.
inline constexpr std::array<std::array<std::uint8_t, 2>, 6> edges_of_tetrahedron = {
    {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};

/// Four vertices in positive order: corners 0 .. 3, or 4 + i for the cut of edge i.
using Piece = std::array<std::uint8_t, 4>;

struct Pieces {
  /// Six cuts make at most 24 pieces; four materials at the corners make six cuts.
  static constexpr std::size_t most = 24;
  std::array<Piece, most> list{{{0, 1, 2, 3}}};
  std::size_t count = 1;

  std::span<const Piece> all() const { return {list.data(), count}; }
  /// Bisects all pieces that have both ends of an edge of the tetrahedron.
  void bisect(std::size_t edge) {
    const auto cut = static_cast<std::uint8_t>(4 + edge);
    for (std::size_t i = 0, n = count; i < n; ++i) {
      const auto a =
          std::find(list[i].begin(), list[i].end(), edges_of_tetrahedron[edge][0]) - list[i].begin();
      const auto b =
          std::find(list[i].begin(), list[i].end(), edges_of_tetrahedron[edge][1]) - list[i].begin();
      if (a == 4 || b == 4) continue;
      assert(count < most);
      list[count] = list[i];
      list[count++][static_cast<std::size_t>(a)] = cut;
      list[i][static_cast<std::size_t>(b)] = cut;
    }
  }
};

}  // namespace tagrid
