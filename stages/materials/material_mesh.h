// The tetrahedra of a mesh with materials.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <span>

#include "stages/grid/lattice.h"
#include "stages/materials/interface.h"
#include "stages/materials/material_lattice.h"
#include "stages/materials/pieces.h"
#include "stages/mesh/tetrahedra.h"

namespace tagrid {

/// A tetrahedron of one material; its vertices are in positive order.
struct MaterialTetrahedron {
  std::array<MeshVertex, 4> vertices;
  Material material = 0;
  /// True if its corners were four points of the lattice, all of them snapped.
  bool all_snapped = false;
};

/// The edges of a cell that have cuts, in the order in which it is bisected: the longest edges first, then those whose
/// lower end comes first, then the upper one.
template <std::size_t n>
struct CellCuts {
  std::array<std::uint8_t, n> order{};
  std::array<bool, n> is_cut{};
  std::size_t count = 0;

  CellCuts(const Interface& interface, std::span<const Index3> corners,
           const std::array<CellEdge, n>& edges) {
    std::array<MeshVertex, n> cuts;
    for (std::uint8_t e = 0; e < n; ++e) {
      const Index3 a = corners[edges[e][0]], b = corners[edges[e][1]];
      if (!interface.is_cut(a, b)) continue;
      cuts[e] = Interface::cut_vertex(a, b);
      is_cut[e] = true;
      order[count++] = e;
    }
    std::sort(order.begin(), order.begin() + count, [&](std::uint8_t a, std::uint8_t b) {
      const MeshVertex &v = cuts[a], &w = cuts[b];
      if (length_class(v.edge) != length_class(w.edge)) return length_class(v.edge) > length_class(w.edge);
      if (!(v.point == w.point)) return is_before(v.point, w.point);
      return is_before(upper_end(v), upper_end(w));
    });
  }
  void bisect(const std::array<CellEdge, n>& edges, Pieces& pieces) const {
    for (std::size_t i = 0; i < count; ++i)
      pieces.bisect(edges[order[i]], static_cast<PieceVertex>(first_cut + order[i]));
  }
  static Index3 upper_end(const MeshVertex& m) {
    return m.point + edge_directions[static_cast<std::size_t>(m.edge)];
  }
};

/// The tetrahedron that is a piece of a cell.
template <std::size_t n>
MaterialTetrahedron tetrahedron_of(const Interface& interface, const Piece& piece,
                                   std::span<const Index3> corners, const std::array<CellEdge, n>& edges) {
  MaterialTetrahedron t;
  t.all_snapped = true;
  for (std::size_t i = 0; i < 4; ++i) {
    if (piece[i] >= first_cut) {
      const CellEdge& ends = edges[static_cast<std::size_t>(piece[i] - first_cut)];
      t.vertices[i] = Interface::cut_vertex(corners[ends[0]], corners[ends[1]]);
      continue;
    }
    t.vertices[i] = {corners[piece[i]], -1};
    if (interface.is_snapped(corners[piece[i]])) continue;
    t.all_snapped = false;
    t.material = interface.material(corners[piece[i]]);
  }
  if (t.all_snapped) {
    // It lies between interfaces; what is at its middle decides.
    Index3 sum;
    for (const MeshVertex& v : t.vertices) sum = sum + interface.position(v);
    t.material = interface.material_at({sum.x >> 2, sum.y >> 2, sum.z >> 2});
  }
  return t;
}

/// Cuts a tetrahedron of the lattice at the interfaces. REQUIRES: corners in positive order.
template <class Visit>
void cut_tetrahedron(const Interface& interface, const std::array<Index3, 4>& corners, Visit& visit) {
  Pieces pieces;
  CellCuts<6>(interface, corners, edges_of_tetrahedron).bisect(edges_of_tetrahedron, pieces);
  for (const Piece& piece : pieces.all())
    visit(tetrahedron_of(interface, piece, corners, edges_of_tetrahedron));
}

/// The dihedral angles of a tetrahedron, judged without trigonometric functions, which could differ between machines:
/// the largest cosine of an angle or of 180 degrees minus it; 2 if it is flat.
double badness_of(const Interface& interface, const MaterialTetrahedron& t);

/// Cuts a pyramid whose base is at the end of the lattice: in the best of the ways in which it can begin.
/// REQUIRES: the base is counterclockwise as seen from the apex, which is the last corner.
template <class Visit>
void cut_pyramid(const Interface& interface, const std::array<Index3, 5>& corners, Visit& visit) {
  CellCuts<8> cuts(interface, corners, edges_of_pyramid);
  const auto differ = [&](std::size_t i) {
    return interface.material(corners[i]) != interface.material(corners[i + 2]) &&
           !interface.is_snapped(corners[i]) && !interface.is_snapped(corners[i + 2]);
  };
  Pieces best;
  begin_pyramid(0, best);
  // Without cuts and snapped corners, all ways are alike.
  const auto is_snapped = [&](Index3 p) { return interface.is_snapped(p); };
  if (cuts.count > 0 || std::any_of(corners.begin(), corners.end(), is_snapped)) {
    double least = 3;
    const std::span<std::uint8_t> order(cuts.order.data(), cuts.count);
    for_each_beginning({differ(0), differ(1)}, cuts.is_cut, order, [&](Pieces pieces) {
      cuts.bisect(edges_of_pyramid, pieces);
      double worst = 0;
      for (std::size_t i = 0; i < pieces.count && worst < least; ++i)
        worst = std::max(worst, badness_of(interface, tetrahedron_of(interface, pieces.list[i], corners,
                                                                     edges_of_pyramid)));
      if (worst >= least) return;
      least = worst;
      best = pieces;
    });
  }
  for (const Piece& piece : best.all()) visit(tetrahedron_of(interface, piece, corners, edges_of_pyramid));
}

/// Calls visit(const MaterialTetrahedron&) for the tetrahedra that belong to a box of root cubes. Those around a long
/// edge between the centers of two cubes belong to the box with the lower center; the boxes of a volume have each
/// tetrahedron once. `active` and `interface` are those of the box and its surroundings.
template <class Visit>
void for_each_material_tetrahedron(const Interface& interface, const LatticeBits& active,
                                   const MaterialLattice& lattice, const Box& closed_box, Visit visit) {
  const Box inside = intersection(closed_box, lattice.box());
  for_each_point_of({inside.low + Index3{1, 1, 1}, inside.high - Index3{1, 1, 1}}, 2, [&](Index3 c) {
    if (!active.test(c)) return;
    for (int axis = 0; axis < 3; ++axis)
      for (const std::int64_t side : {-1, 1}) {
        const Index3 other = c + 2 * side * unit_vector(axis);
        const bool is_whole = interface.is_marked(other);
        if (is_whole && side < 0) continue;
        const Square s = square_of(c, axis, side);
        if (is_whole) {
          for (std::size_t i = 0; i < 4; ++i)
            cut_tetrahedron(interface, {c, other, s[i], s[(i + 1) % 4]}, visit);
          continue;
        }
        if (interface.is_at_end(c, axis, side)) {
          if (side < 0)
            cut_pyramid(interface, {s[0], s[1], s[2], s[3], c}, visit);
          else
            cut_pyramid(interface, {s[0], s[3], s[2], s[1], c}, visit);
          continue;
        }
        const auto d = static_cast<std::size_t>(interface.diagonal(c, axis, side));
        for (std::size_t half = 0; half < 2; ++half) {
          const Index3 a = s[d + 2 * half], b = s[(d + 2 * half + 1) % 4], e = s[(d + 2 * half + 2) % 4];
          cut_tetrahedron(interface,
                          side > 0 ? std::array<Index3, 4>{a, e, b, c} : std::array<Index3, 4>{a, b, e, c},
                          visit);
        }
      }
  });
  const int level_of_halves = max_level(lattice.cube_size) - 2;
  for_each_leaf_tetrahedron(active, closed_box, lattice.cube_size, level_of_halves,
                            [&](const Tetrahedron& leaf) {
                              if (leaf.level == level_of_halves)
                                return;  // bisected at the center of a cube: see above
                              for (const Index3 p : leaf.vertices)
                                if (!lattice.box().contains(p)) return;
                              // Its cubes are not marked, so none has several materials.
                              MaterialTetrahedron t;
                              for (std::size_t i = 0; i < 4; ++i) t.vertices[i] = {leaf.vertices[i], -1};
                              t.material = interface.material(leaf.vertices[0]);
                              visit(t);
                            });
}

/// The peak of the heap that the tetrahedra of a box of root cubes take: the materials of its region, its activity, and
/// its interface. Samples are not included.
std::uint64_t working_bytes_of_material_mesh(const MaterialLattice& lattice, const Box& closed_box);

}  // namespace tagrid
