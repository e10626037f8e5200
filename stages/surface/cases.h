// The triangles of marching tetrahedra: how a tetrahedron is cut if some of its vertices are inside.
//
// Source: A. Doi and A. Koide, "An efficient method of triangulating equi-valued surfaces by using
// tetrahedral cells", 1991. There are no ambiguous cases. The tables are computed from the rule, for all
// sides of the four vertices.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <utility>

namespace tagrid {

/// A corner of a triangle: on the edge between two vertices of a tetrahedron, or a vertex (a == b).
struct CutEdge {
  unsigned char a = 0, b = 0;
};

struct CutTriangles {
  std::array<std::array<CutEdge, 3>, 2> triangles{};
  std::size_t count = 0;

  constexpr const std::array<CutEdge, 3>* begin() const { return triangles.data(); }
  constexpr const std::array<CutEdge, 3>* end() const { return triangles.data() + count; }
  constexpr void add(CutEdge p, CutEdge q, CutEdge r) { triangles[count++] = {p, q, r}; }
};

namespace surface_cases {

constexpr bool is_inside(unsigned inside, unsigned vertex) { return (inside >> vertex) & 1; }

constexpr CutEdge edge(unsigned a, unsigned b) {
  return {static_cast<unsigned char>(a), static_cast<unsigned char>(b)};
}

/// Whether the order of four vertices has the orientation of 0, 1, 2, 3.
constexpr bool is_even(const std::array<unsigned, 4>& order) {
  bool even = true;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (order[j] > order[i]) even = !even;
  return even;
}

/// `inside` has a bit for each vertex.
constexpr CutTriangles cut_tetrahedron(unsigned inside) {
  // The vertices, those inside first.
  std::array<unsigned, 4> v{};
  std::size_t n = 0;
  for (const bool wanted : {true, false})
    for (unsigned i = 0; i < 4; ++i)
      if (is_inside(inside, i) == wanted) v[n++] = i;
  // An exchange on one side, so that the order is positive.
  if (!is_even(v)) std::popcount(inside) == 3 ? std::swap(v[0], v[1]) : std::swap(v[2], v[3]);
  CutTriangles cut;
  switch (std::popcount(inside)) {
    case 1:
      cut.add(edge(v[0], v[1]), edge(v[0], v[2]), edge(v[0], v[3]));
      break;
    case 2:
      cut.add(edge(v[0], v[2]), edge(v[0], v[3]), edge(v[1], v[3]));
      cut.add(edge(v[0], v[2]), edge(v[1], v[3]), edge(v[1], v[2]));
      break;
    case 3:
      cut.add(edge(v[3], v[0]), edge(v[3], v[1]), edge(v[3], v[2]));
      break;
    default:
      break;
  }
  return cut;
}

/// The part of a face that is inside. The face has the vertices 0, 1, 2, as seen from outside.
constexpr CutTriangles cut_face(unsigned inside) {
  CutTriangles cut;
  if (inside == 7) cut.add(edge(0, 0), edge(1, 1), edge(2, 2));
  if (inside == 7 || inside == 0) return cut;
  // p is the one vertex on its side.
  const bool alone_inside = std::popcount(inside) == 1;
  unsigned p = 0;
  while (is_inside(inside, p) != alone_inside) ++p;
  const unsigned q = (p + 1) % 3, r = (p + 2) % 3;
  if (alone_inside) {
    cut.add(edge(p, p), edge(p, q), edge(p, r));
  } else {
    cut.add(edge(q, q), edge(r, r), edge(r, p));
    cut.add(edge(q, q), edge(r, p), edge(p, q));
  }
  return cut;
}

template <std::size_t cases, class Cut>
constexpr std::array<CutTriangles, cases> all_of(Cut cut) {
  std::array<CutTriangles, cases> table{};
  for (unsigned inside = 0; inside < cases; ++inside) table[inside] = cut(inside);
  return table;
}

}  // namespace surface_cases

/// The triangles in a positive tetrahedron, by the bits of the vertices that are inside. Seen from outside,
/// their corners are counterclockwise.
inline constexpr std::array<CutTriangles, 16> triangles_in_tetrahedron =
    surface_cases::all_of<16>(surface_cases::cut_tetrahedron);

/// The triangles of the part of a face that is inside, likewise.
inline constexpr std::array<CutTriangles, 8> triangles_in_face =
    surface_cases::all_of<8>(surface_cases::cut_face);

/// The vertices of the faces of a positive tetrahedron, counterclockwise as seen from outside of it. Face i
/// is opposite to vertex i.
inline constexpr std::array<std::array<unsigned char, 3>, 4> faces_of_tetrahedron = {
    {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};

}  // namespace tagrid
