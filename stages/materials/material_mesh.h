// The tetrahedra of a mesh with materials.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>

#include "stages/grid/lattice.h"
#include "stages/materials/interface.h"
#include "stages/materials/material_lattice.h"
#include "stages/materials/pieces.h"
#include "stages/mesh/tetrahedra.h"

namespace tagrid {

/// A tetrahedron of one material; its vertices are in positive order.
struct MaterialTetrahedron {
  std::array<MeshVertex, 4> vertices;
  std::uint8_t material = 0;
  /// True if its corners were four points of the lattice, all of them snapped.
  bool all_snapped = false;
};

/// Cuts a tetrahedron of the lattice at the interfaces. REQUIRES: corners in positive order.
template <class Visit>
void cut_tetrahedron(const Interface& interface, const std::array<Index3, 4>& corners, Visit& visit) {
  std::array<std::uint8_t, 6> edges{};
  std::size_t cuts = 0;
  for (std::uint8_t e = 0; e < 6; ++e)
    if (interface.is_cut(corners[edges_of_tetrahedron[e][0]], corners[edges_of_tetrahedron[e][1]]))
      edges[cuts++] = e;
  // The longest edges first, then those whose lower end comes first, then the upper one.
  std::sort(edges.begin(), edges.begin() + cuts, [&](std::uint8_t a, std::uint8_t b) {
    const auto vertex = [&](std::uint8_t e) {
      return Interface::cut_vertex(corners[edges_of_tetrahedron[e][0]], corners[edges_of_tetrahedron[e][1]]);
    };
    const MeshVertex v = vertex(a), w = vertex(b);
    if (length_class(v.edge) != length_class(w.edge)) return length_class(v.edge) > length_class(w.edge);
    if (!(v.point == w.point)) return is_before(v.point, w.point);
    const auto end = [](const MeshVertex& m) {
      return m.point + edge_directions[static_cast<std::size_t>(m.edge)];
    };
    return is_before(end(v), end(w));
  });
  Pieces pieces;
  for (std::size_t i = 0; i < cuts; ++i) pieces.bisect(edges[i]);
  for (const Piece& piece : pieces.all()) {
    MaterialTetrahedron t;
    t.all_snapped = true;
    for (std::size_t i = 0; i < 4; ++i) {
      if (piece[i] >= 4) {
        const auto& ends = edges_of_tetrahedron[piece[i] - 4U];
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
    visit(t);
  }
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

}  // namespace tagrid
