// Finds the tetrahedra of a brick that a surface crosses.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <type_traits>
#include <utility>
#include <vector>

#include "stages/grid/lattice.h"
#include "stages/mesh/cut.h"
#include "stages/mesh/meets.h"
#include "stages/mesh/tetrahedra.h"
#include "stages/surface/field_of_cube.h"
#include "stages/surface/packed_point.h"
#include "stages/surface/surface.h"

namespace tagrid {

/// A leaf, or a piece of one, some of whose vertices are inside.
struct CrossedTetrahedron {
  std::array<PackedPoint, 4> vertices;  ///< relative to the brick; in positive order
  unsigned inside = 0;                  ///< a bit for each vertex
  std::array<double, 4> values{};       ///< not set if all vertices are inside
  bool at_border = false;               ///< it may have a face in the border of the volume
};

/// The tetrahedra that a surface crosses and, if it is to be closed, those at the border that are all inside. Most of a
/// brick is not visited: a cell whose active points lie on one side contains no crossing.
template <class T>
class Crossings {
 public:
  /// All of the arguments must outlive the object. See surface_of_brick().
  Crossings(std::span<const T> points, const LatticeBits& active, const SurfaceGrid& grid,
            const SurfaceLevel& level)
      : points_(points),
        active_(active),
        low_(active.box().low),
        inside_(active.box()),
        order_(active.box().size()),
        sides_(points.size()),
        grid_(grid),
        level_(level),
        deepest_(max_level(grid.cube_size)),
        field_(points, active, grid.cube_size) {
    find_inside();
  }

  static std::uint64_t working_bytes(Index3 size, int cube_size) {
    return LatticeBits::working_bytes(size) +
           static_cast<std::uint64_t>(size.x * size.y * size.z) * sizeof(Side) +
           FieldOfCube<T>::working_bytes(cube_size);
  }

  /// Calls visit(const CrossedTetrahedron&), in a fixed order.
  template <class Visit>
  void for_each(Visit visit) {
    const Box& box = active_.box();
    const int s = grid_.cube_size;
    for (std::int64_t z = box.low.z; z < box.high.z; z += s)
      for (std::int64_t y = box.low.y; y < box.high.y; y += s)
        for (std::int64_t x = box.low.x; x < box.high.x; x += s) {
          const Index3 corner{x, y, z};
          if (!may_matter(corner, s)) continue;
          field_.begin(corner);
          at_border_ = reaches_border(corner, s);
          for (const BisectionStep& root : root_tetrahedra(corner, s)) {
            std::array<PackedPoint, 4> v;
            for (std::size_t i = 0; i < 4; ++i) v[i] = pack(root.vertices[i] - low_);
            descend<3>(v, 0, root.negative, visit);
          }
        }
  }

  /// True if a tetrahedron with a NaN was left out.
  bool has_gaps() const { return has_gaps_; }

 private:
  enum class Side : std::uint8_t { not_active, outside, inside };

  // Cells from this edge on are examined: with smaller ones, that takes longer than to visit their tetrahedra.
  static constexpr int smallest_examined = 4;

  double value(PackedPoint p) const { return static_cast<double>(points_[order_.number(p)]); }
  Side side(PackedPoint p) const { return sides_[order_.number(p)]; }

  void find_inside() {
    const Box& box = active_.box();
    std::size_t row_start = 0;
    for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
      for (std::int64_t y = box.low.y; y <= box.high.y; ++y) {
        const std::uint64_t* active = active_.row(y, z);
        std::uint64_t* inside = inside_.row(y, z);
        for (std::size_t w = 0; w < active_.words_per_row(); ++w)
          for (std::uint64_t rest = active[w]; rest != 0; rest &= rest - 1) {
            const auto bit = static_cast<std::size_t>(std::countr_zero(rest)), i = row_start + 64 * w + bit;
            const bool is_inside = level_.is_inside(static_cast<double>(points_[i]));
            sides_[i] = is_inside ? Side::inside : Side::outside;
            inside[w] |= std::uint64_t{is_inside} << bit;
          }
        row_start += static_cast<std::size_t>(box.size().x);
      }
  }

  // False if no tetrahedron in the cell is to be visited.
  bool may_matter(Index3 corner, int edge) const {
    bool some_in = false, some_out = false;
    const auto first = static_cast<std::size_t>(corner.x - low_.x),
               end = first + static_cast<std::size_t>(edge) + 1;
    const auto look = [&](std::int64_t y, std::int64_t z) {
      const std::uint64_t *active = active_.row(y, z), *inside = inside_.row(y, z);
      for (std::size_t bit = first; bit < end; bit = (bit / 64 + 1) * 64) {
        std::uint64_t mask = ~std::uint64_t{0} << (bit % 64);
        if (end < (bit / 64 + 1) * 64) mask &= (std::uint64_t{1} << (end % 64)) - 1;
        some_in = some_in || (inside[bit / 64] & mask) != 0;
        some_out = some_out || (active[bit / 64] & ~inside[bit / 64] & mask) != 0;
      }
    };
    for (std::int64_t z = corner.z; z <= corner.z + edge; ++z)
      for (std::int64_t y = corner.y; y <= corner.y + edge; ++y) {
        look(y, z);
        if (some_in && some_out) return true;
      }
    return some_in && grid_.close && reaches_border(corner, edge);
  }

  bool reaches_border(Index3 corner, int edge) const {
    for (int axis = 0; axis < 3; ++axis)
      if (corner[axis] == 0 || corner[axis] + edge >= grid_.last[axis]) return true;
    return false;
  }

  // As for_each_leaf_below(). The base edge joins vertices 0 and `end`, which is 3 - level % 3.
  template <int end, class Visit>
  void descend(const std::array<PackedPoint, 4>& v, int level, bool negative, Visit& visit) {
    if constexpr (end == 3) {
      // Such a tetrahedron lies in a cell of edge S / 2^(level / 3), with an edge along its diagonal.
      const int edge = grid_.cube_size >> (level / 3);
      if (level > 0 && edge >= smallest_examined && !may_matter(low_corner(v), edge)) return;
    }
    if (level == deepest_) return visit_leaf(v, negative, visit);
    const PackedPoint middle = (v[0] + v[end]) >> 1;
    if (side(middle) == Side::not_active) return visit_leaf(v, negative, visit);
    constexpr int next = end == 1 ? 3 : end - 1;
    std::array<PackedPoint, 4> half = v;
    half[end] = middle;
    descend<next>(half, level + 1, negative, visit);
    half = v;
    for (std::size_t i = 0; i < end; ++i) half[i] = v[i + 1];
    half[end] = middle;
    descend<next>(half, level + 1, negative != (end % 2 == 1), visit);
  }

  Index3 low_corner(const std::array<PackedPoint, 4>& vertices) const {
    Index3 low = unpack(vertices[0]);
    for (std::size_t i = 1; i < 4; ++i) {
      const Index3 p = unpack(vertices[i]);
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    }
    return low_ + low;
  }

  template <class Visit>
  void visit_leaf(const std::array<PackedPoint, 4>& v, bool negative, Visit& visit) {
    unsigned inside = 0;
    for (unsigned i = 0; i < 4; ++i) inside |= static_cast<unsigned>(side(v[i]) == Side::inside) << i;
    if (inside == 0 || (inside == 15 && !(grid_.close && at_border_))) return;
    CrossedTetrahedron t{v, inside};
    if (negative) std::swap(t.vertices[2], t.vertices[3]);
    t.at_border = at_border_;
    if (at_border_) {
      const std::array<Index3, 4> vertices = in_volume(t.vertices);
      if (reaches_beyond(vertices, grid_.last)) return visit_pieces(vertices, inside == 15, visit);
    }
    if (inside != 15) set_values(t);
    if (!is_gap(t)) pass_on(t, visit);
  }

  template <class Visit>
  void visit_pieces(const std::array<Index3, 4>& vertices, bool all_inside, Visit& visit) {
    if (!all_inside) {
      CrossedTetrahedron whole{packed(vertices)};
      set_values(whole);
      if (is_gap(whole)) return;
    }
    for (const std::array<Index3, 4>& piece : cut_at(vertices, grid_.last)) {
      CrossedTetrahedron t{packed(piece), 15, {}, true};
      if (!all_inside) {
        for (std::size_t i = 0; i < 4; ++i) t.values[i] = static_cast<double>(field_.at(piece[i]));
        set_inside(t);
      }
      if (t.inside != 0 && (t.inside != 15 || grid_.close)) pass_on(t, visit);
    }
  }

  void set_values(CrossedTetrahedron& t) const {
    for (std::size_t i = 0; i < 4; ++i) t.values[i] = value(t.vertices[i]);
    set_inside(t);
  }
  void set_inside(CrossedTetrahedron& t) const {
    t.inside = 0;
    for (unsigned i = 0; i < 4; ++i) t.inside |= static_cast<unsigned>(level_.is_inside(t.values[i])) << i;
  }

  // True if a leaf is left out because it has a NaN.
  bool is_gap(const CrossedTetrahedron& t) {
    if (!std::is_floating_point_v<T> || grid_.close || t.inside == 15) return false;
    const bool gap = std::ranges::any_of(t.values, [](double value) { return std::isnan(value); });
    has_gaps_ = has_gaps_ || gap;
    return gap;
  }

  template <class Visit>
  void pass_on(const CrossedTetrahedron& t, Visit& visit) const {
    if (!grid_.box || meets(in_volume(t.vertices), *grid_.box)) visit(t);
  }

  std::array<Index3, 4> in_volume(const std::array<PackedPoint, 4>& v) const {
    return {low_ + unpack(v[0]), low_ + unpack(v[1]), low_ + unpack(v[2]), low_ + unpack(v[3])};
  }
  std::array<PackedPoint, 4> packed(const std::array<Index3, 4>& v) const {
    return {pack(v[0] - low_), pack(v[1] - low_), pack(v[2] - low_), pack(v[3] - low_)};
  }

  std::span<const T> points_;
  const LatticeBits& active_;
  Index3 low_;
  LatticeBits inside_;
  RasterOrder order_;
  std::vector<Side> sides_;  // of all points
  const SurfaceGrid& grid_;
  const SurfaceLevel& level_;
  int deepest_;
  FieldOfCube<T> field_;
  bool at_border_ = false;  // the current root cube
  bool has_gaps_ = false;
};

}  // namespace tagrid
