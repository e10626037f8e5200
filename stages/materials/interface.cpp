#include "stages/materials/interface.h"

#include <algorithm>
#include <limits>

#include "stages/grid/lattice.h"

namespace tagrid {

Square square_of(Index3 center, int axis, std::int64_t side) {
  const Index3 middle = center + side * unit_vector(axis), u = unit_vector((axis + 1) % 3),
               w = unit_vector((axis + 2) % 3);
  return {middle + u + w, middle - u + w, middle - u - w, middle + u - w};
}

Interface::Interface(const MaterialField& field, const PointMaterials& materials, const LatticeBits& active,
                     const MaterialLattice& lattice, const Box& box, const SnapRule& rule)
    : field_(&field),
      active_(&active),
      lattice_(lattice),
      rule_(rule),
      inside_{{1, 1, 1}, lattice.last - Index3{1, 1, 1}},
      points_(box),
      material_(points_.count()),
      snapped_(points_.count(), not_snapped),
      way_(points_.count(), rule.way),
      cuts_(points_.count() * edges_of_point, no_cut) {
  for_each_bcc_point(box, [&](Index3 p) { material_[points_.number(p)] = materials.at(p); });
  const Box centers{box.low + Index3{1, 1, 1}, box.high - Index3{1, 1, 1}};
  for_each_bcc_point(box, [&](Index3 p) { find_cuts(p); });
  for_each_bcc_point(box, [&](Index3 p) { snap(p); });
  for_each_point_of(centers, 2, [&](Index3 center) {
    if (is_marked(center)) shorten_ways(center);
  });
}

void Interface::find_cuts(Index3 p) {
  const Material material = material_[points_.number(p)];
  for (int edge = 0; edge < edges_of_point; ++edge) {
    const Index3 q = p + edge_directions[static_cast<std::size_t>(edge)];
    if (points_.box().contains(q) && material_[points_.number(q)] != material) find_cut(p, edge);
  }
}

void Interface::find_cut(Index3 p, int edge) {
  const Index3 direction = edge_directions[static_cast<std::size_t>(edge)];
  const std::int32_t cut = field_->find_cut(p, direction, material(p), material(p + direction));
  cuts_[points_.number(p) * edges_of_point + static_cast<std::size_t>(edge)] =
      static_cast<std::uint16_t>(std::min(cut, cut_parts - 2));
}

// True if both points are in a plane where the lattice ends.
bool Interface::is_in_end(Index3 p, Index3 q) const {
  for (int axis = 0; axis < 3; ++axis)
    if (p[axis] == q[axis] && (p[axis] == 0 || p[axis] == lattice_.last[axis])) return true;
  return false;
}

// Distances are compared as squares, in integers.
void Interface::snap(Index3 p) {
  std::int64_t nearest = std::numeric_limits<std::int64_t>::max();
  std::uint8_t& snapped = snapped_[points_.number(p)];
  for (int edge = 0; edge < edges_of_point; ++edge)
    for (int upper = 0; upper < 2; ++upper) {
      const Index3 direction = edge_directions[static_cast<std::size_t>(edge)];
      const Index3 lower_end = upper ? p - direction : p;
      if (!points_.box().contains(upper ? lower_end : p + direction)) continue;
      const std::uint16_t cut =
          cuts_[points_.number(lower_end) * edges_of_point + static_cast<std::size_t>(edge)];
      if (cut == no_cut) continue;
      const auto length = static_cast<std::size_t>(length_class(edge));
      const std::int64_t distance = upper ? cut_parts - cut : cut;
      if (distance >= rule_.limit(length_class(edge), is_in_end(p, upper ? lower_end : p + direction)))
        continue;
      const std::int64_t square = distance * distance * squared_lengths[length];
      if (square >= nearest) continue;
      nearest = square;
      snapped = static_cast<std::uint8_t>(2 * edge + upper);
    }
}

void Interface::shorten_ways(Index3 center) {
  for (int axis = 0; axis < 3; ++axis)
    for (const std::int64_t side : {-1, 1}) {
      const Square square = square_of(center, axis, side);
      const Index3 other = center + 2 * side * unit_vector(axis);
      if (!is_marked(other)) {
        const bool ends = is_at_end(center, axis, side);
        limit_way(center, ends ? rule_.at_end : rule_.of_half_pyramids);
        for (const Index3 corner : square) limit_way(corner, ends ? rule_.at_end : rule_.of_half_pyramids);
        if (ends || !is_snapped(center)) continue;
        const auto d = static_cast<std::size_t>(diagonal(center, axis, side));
        for (std::size_t half = 0; half < 4; half += 2) {
          const std::array<Index3, 4> corners = {center, square[d + half], square[(d + half + 1) % 4],
                                                 square[(d + half + 2) % 4]};
          if (std::all_of(corners.begin(), corners.end(), [&](Index3 p) { return is_snapped(p); }))
            for (const Index3 corner : corners) limit_way(corner, rule_.of_half_pyramids_if_all_are_snapped);
        }
        continue;
      }
      if (side < 0 || !points_.box().contains(other)) continue;  // belongs to the other cube, or is not known
      if (!is_snapped(center) || !is_snapped(other)) continue;
      for (std::size_t i = 0; i < 4; ++i) {
        const Index3 a = square[i], b = square[(i + 1) % 4];
        if (!is_snapped(a) || !is_snapped(b)) continue;
        for (const Index3 corner : {center, other, a, b}) limit_way(corner, rule_.if_all_are_snapped);
      }
    }
}

int Interface::diagonal(Index3 center, int axis, std::int64_t side) const {
  const Square square = square_of(center, axis, side);
  const Index3 middle = center + side * unit_vector(axis);
  const BaseEdge edge = base_edge(middle, classify(middle, lattice_.cube_size), lattice_.cube_size);
  return edge.left == square[0] || edge.left == square[2] ? 0 : 1;
}

Index3 Interface::position(const MeshVertex& vertex) const {
  constexpr std::int64_t scale = parts_per_point / cut_parts;
  static_assert(scale == 4);  // ways are quarters
  const Index3 p = vertex.point, at_point = parts_per_point * p;
  const std::size_t number = points_.number(p);
  const auto cut_of = [&](std::size_t point, int edge) {
    return std::int64_t{cuts_[point * edges_of_point + static_cast<std::size_t>(edge)]};
  };
  if (vertex.edge >= 0)
    return at_point +
           scale * cut_of(number, vertex.edge) * edge_directions[static_cast<std::size_t>(vertex.edge)];
  const std::uint8_t snapped = snapped_[number];
  if (snapped == not_snapped) return at_point;
  const int edge = snapped / 2;
  const Index3 direction = edge_directions[static_cast<std::size_t>(edge)];
  const Index3 moved =
      snapped % 2 == 0 ? way_[number] * cut_of(number, edge) * direction
                       : way_[number] * (cut_of(points_.number(p - direction), edge) - cut_parts) * direction;
  Index3 result = at_point;
  // The planes where the lattice ends stay planes.
  for (int axis = 0; axis < 3; ++axis)
    if (p[axis] > 0 && p[axis] < lattice_.last[axis]) result[axis] += moved[axis];
  return result;
}

}  // namespace tagrid
