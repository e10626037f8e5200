// Where the interfaces between materials pass: cuts of edges, and vertices that are snapped to a cut.
//
// A cut that is close to an end of its edge would make flat tetrahedra. So the end moves to the cut instead: it is
// snapped, and no edge of it is cut. All vertices are snapped at once, each to its nearest cut, so the order of work
// does not matter. The method and the limits for edges of the body-centered cubic lattice are those of isosurface
// stuffing (Labelle and Shewchuk, Isosurface Stuffing, SIGGRAPH 2007); cuts are integers, and ties are decided by the
// order of edges, so each brick finds the same vertices.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "stages/materials/bcc_lattice.h"
#include "stages/materials/material_field.h"
#include "stages/materials/material_lattice.h"

namespace tagrid {

/// An end of an edge is snapped if a cut is nearer to it than a limit, in cut_parts. It then goes so many quarters of the
/// way to its cut. How the numbers were found: docs/dev/decisions/0065-mesh-with-materials.md.
struct SnapRule {
  std::int32_t of_short_edges, of_long_edges;
  std::int32_t in_end;  ///< of long edges in a plane where the lattice ends
  std::uint8_t way;
  std::uint8_t if_all_are_snapped;  ///< for the corners of a tetrahedron whose corners are all snapped
  std::uint8_t at_end;              ///< for corners of pyramids at the end of the lattice
  /// For corners of half pyramids where tetrahedra become coarser.
  std::uint8_t of_half_pyramids, of_half_pyramids_if_all_are_snapped;

  constexpr std::int32_t limit(int length_class, bool is_in_end) const {
    return length_class == 0 ? of_short_edges : is_in_end ? in_end : of_long_edges;
  }
};
/// Vertices are on the interface, except a few; dihedral angles are at least 9 degrees.
inline constexpr SnapRule closest_vertices = {27001, 16384, 26214, 4, 3, 3, 2, 1};
/// Snapped vertices are up to a tenth of H from the interface; angles are at least 15 degrees, at the end of the lattice
/// 12.
inline constexpr SnapRule best_angles = {30802, 19661, 29491, 3, 2, 2, 1, 1};

/// The four corners of a face of a cube, counterclockwise as seen from where `axis` points.
using Square = std::array<Index3, 4>;
/// REQUIRES: `side` is -1 or 1.
Square square_of(Index3 center, int axis, std::int64_t side);

class Interface {
 public:
  /// The cuts and vertices in a box of points. `active`: see activity_of_materials(). `field` must stay.
  /// REQUIRES: `materials` has the points of the box.
  Interface(const MaterialField& field, const PointMaterials& materials, const LatticeBits& active,
            const MaterialLattice& lattice, const Box& box, const SnapRule& rule = closest_vertices);

  /// The heap that the interface in a box takes.
  static std::uint64_t working_bytes(const Box& box) {
    return BccBox(box).count() * (4 + edges_of_point * sizeof(std::uint16_t));
  }

  Material material(Index3 p) const { return material_[points_.number(p)]; }
  bool is_snapped(Index3 p) const { return snapped_[points_.number(p)] != not_snapped; }
  /// True if the edge between two points has a cut that is a vertex.
  bool is_cut(Index3 p, Index3 q) const {
    return !is_snapped(p) && !is_snapped(q) && edge_of_direction(q - p) >= 0 && cut(p, q) != no_cut;
  }
  /// The vertex at the cut between two points.
  static MeshVertex cut_vertex(Index3 p, Index3 q) {
    return is_before(p, q) ? MeshVertex{p, edge_of_direction(q - p)}
                           : MeshVertex{q, edge_of_direction(p - q)};
  }
  /// In parts of the lattice.
  Index3 position(const MeshVertex& vertex) const;
  /// The material at a position.
  Material material_at(Index3 position) const { return field_->at(position); }
  /// True if a cube of the lattice is bisected at its center. Cubes far from the brick, of which that is not known,
  /// are not.
  bool is_marked(Index3 center) const {
    return inside_.contains(center) && active_->box().contains(center) && active_->test(center);
  }
  /// True if a face of a cube is at the end of the lattice.
  bool is_at_end(Index3 center, int axis, std::int64_t side) const {
    return !inside_.contains(center + 2 * side * unit_vector(axis));
  }
  /// 0 if the half pyramids on both sides of a face share its diagonal from corner 0 to corner 2, 1 if from 1 to 3.
  int diagonal(Index3 center, int axis, std::int64_t side) const;

 private:
  static constexpr std::uint8_t not_snapped = 255;
  static constexpr std::uint16_t no_cut = 65535;

  std::uint16_t cut(Index3 p, Index3 q) const {
    const MeshVertex v = cut_vertex(p, q);
    return cuts_[points_.number(v.point) * edges_of_point + static_cast<std::size_t>(v.edge)];
  }
  void find_cuts(Index3 p);
  void find_cut(Index3 p, int edge);
  void snap(Index3 p);
  bool is_in_end(Index3 p, Index3 q) const;
  void shorten_ways(Index3 center);
  void limit_way(Index3 p, std::uint8_t way) {
    if (!points_.box().contains(p)) return;
    std::uint8_t& of_point = way_[points_.number(p)];
    of_point = std::min(of_point, way);
  }

  const MaterialField* field_;
  const LatticeBits* active_;
  MaterialLattice lattice_;
  SnapRule rule_;
  Box inside_;     ///< the centers of the lattice
  BccBox points_;  ///< the next ones are by its numbers
  std::vector<Material> material_;
  std::vector<std::uint8_t> snapped_;  ///< 2 * edge, + 1 if the point is the upper end
  std::vector<std::uint8_t> way_;      ///< in quarters
  std::vector<std::uint16_t> cuts_;    ///< edges_of_point for each point, from the lower end
};

}  // namespace tagrid
