// The pieces of a tetrahedron or a pyramid that is cut at points of its edges: it is bisected at one edge after the
// other, in an order that belongs to the edges. So two cells cut their common face alike, for any number of materials
// and without a table. No piece has corners of two materials, because the edge between them would be cut. Each piece of
// a tetrahedron has at least one of its corners that were not snapped, if there is one.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

namespace tagrid {

/// A vertex of a piece: corners 0 .. 4, of which tetrahedra have the first four; first_cut + i for the cut of edge i.
using PieceVertex = std::uint8_t;
inline constexpr PieceVertex first_cut = 5;
/// Four vertices in positive order.
using Piece = std::array<PieceVertex, 4>;
using CellEdge = std::array<PieceVertex, 2>;

/// The edges of a tetrahedron.
inline constexpr std::array<CellEdge, 6> edges_of_tetrahedron = {
    {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};
/// The edges of a pyramid: its base 0 1 2 3, whose edge i leaves corner i, and those to its apex 4.
inline constexpr std::array<CellEdge, 8> edges_of_pyramid = {
    {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {0, 4}, {1, 4}, {2, 4}, {3, 4}}};

struct Pieces {
  /// A tetrahedron has at most 8 pieces, a pyramid 14 (tests/stages/materials/pieces_test.cpp).
  static constexpr std::size_t most = 14;
  std::array<Piece, most> list{{{0, 1, 2, 3}}};
  std::size_t count = 1;

  std::span<const Piece> all() const { return {list.data(), count}; }
  void add(const Piece& piece) {
    assert(count < most);
    list[count++] = piece;
  }
  /// Bisects all pieces that have both ends of an edge.
  void bisect(const CellEdge& edge, PieceVertex cut) {
    for (std::size_t i = 0, n = count; i < n; ++i) {
      const auto a = std::find(list[i].begin(), list[i].end(), edge[0]) - list[i].begin();
      const auto b = std::find(list[i].begin(), list[i].end(), edge[1]) - list[i].begin();
      if (a == 4 || b == 4) continue;
      Piece other = list[i];
      other[static_cast<std::size_t>(a)] = cut;
      list[i][static_cast<std::size_t>(b)] = cut;
      add(other);
    }
  }
};

/// A way to begin with a pyramid whose base is a face at the end of the lattice, where nothing has to agree with it:
/// as two tetrahedra that share a diagonal of the base, or, between the cuts of opposite edges of the base, as two
/// pyramids that are each two tetrahedra. So no diagonal is ever cut.
///
/// Number 0 and 1: the diagonal from corner 0 to 2, or from 1 to 3. 2 .. 9: (number - 2) / 4 is the first of the two
/// edges that are joined, the rest which diagonals the two new bases have.
inline constexpr int ways_to_begin = 10;

/// REQUIRES: the base is counterclockwise as seen from the apex.
constexpr void begin_pyramid(int way, Pieces& pieces) {
  pieces.count = 0;
  const auto add_base = [&](PieceVertex a, PieceVertex b, PieceVertex c, PieceVertex d,
                            bool second_diagonal) {
    if (second_diagonal) {
      pieces.add({b, c, d, 4});
      pieces.add({b, d, a, 4});
    } else {
      pieces.add({a, b, c, 4});
      pieces.add({a, c, d, 4});
    }
  };
  if (way < 2) return add_base(0, 1, 2, 3, way == 1);
  const int first = (way - 2) / 4, diagonals = (way - 2) % 4;
  const auto corner = [&](int i) { return static_cast<PieceVertex>((first + i) % 4); };
  const auto cut = [&](int i) { return static_cast<PieceVertex>(first_cut + corner(i)); };
  add_base(cut(0), corner(1), corner(2), cut(2), diagonals % 2 == 1);
  add_base(cut(2), corner(3), corner(0), cut(0), diagonals / 2 == 1);
}

/// True if a pyramid can begin like this: no diagonal is between corners of two materials that are not snapped, and
/// the edges to be joined have cuts. `differ`: whether the corners 0 and 2, and 1 and 3, are such.
constexpr bool can_begin(int way, const std::array<bool, 2>& differ, const std::array<bool, 8>& is_cut) {
  if (way < 2) return !differ[static_cast<std::size_t>(way)];
  const auto first = static_cast<std::size_t>((way - 2) / 4);
  return is_cut[first] && is_cut[first + 2];
}

/// Calls visit(const Pieces&) for all ways in which a pyramid can begin, and all orders of the cuts of its base, which
/// its neighbors do not see. `cuts`: the edges that have cuts, those of the base first; their order changes, and is the
/// one to bisect in.
template <class Edge, class Visit>
void for_each_beginning(const std::array<bool, 2>& differ, const std::array<bool, 8>& is_cut,
                        std::span<Edge> cuts, Visit visit) {
  const auto end_of_base = std::find_if(cuts.begin(), cuts.end(), [](Edge e) { return e >= 4; });
  std::sort(cuts.begin(), end_of_base);
  for (int way = 0; way < ways_to_begin; ++way) {
    if (!can_begin(way, differ, is_cut)) continue;
    Pieces begun;
    begin_pyramid(way, begun);
    do visit(std::as_const(begun));
    while (std::next_permutation(cuts.begin(), end_of_base));
  }
}

}  // namespace tagrid
