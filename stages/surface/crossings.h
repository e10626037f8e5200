// Finds the tetrahedra of a brick that a surface crosses.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "stages/grid/lattice.h"
#include "stages/grid/lattice_bits.h"
#include "stages/mesh/cut.h"
#include "stages/mesh/tetrahedra.h"
#include "stages/surface/edge_numbers.h"
#include "stages/surface/sides.h"
#include "stages/surface/surface.h"
#include "stages/values/points/field.h"

namespace tagrid {

/// The piecewise linear field, rounded to samples, at all points of one root cube at a time. Few root cubes
/// need it, so it is computed when the first value of a cube is read. No base edge leaves the closed root
/// cube of its midpoint, so the values are those that the field of the entire brick has.
template <class T>
class FieldOfCube {
 public:
  /// `points` and `active` must outlive the object. See surface_of_brick().
  FieldOfCube(std::span<const T> points, const LatticeBits& active, int cube_size)
      : points_(points), active_(active), cube_size_(cube_size) {}

  static std::uint64_t working_bytes(int cube_size) {
    const Index3 size{cube_size + 1, cube_size + 1, cube_size + 1};
    const auto points = static_cast<std::uint64_t>(size.x * size.y * size.z);
    return points * (2 * sizeof(T) + sizeof(FieldNumber<T>)) + LatticeBits::working_bytes(size);
  }

  void begin(Index3 corner) {
    const Index3 edges{cube_size_, cube_size_, cube_size_};
    cube_ = {corner, corner + edges};
    is_known_ = false;
  }
  /// REQUIRES: begin() was called for a root cube that contains `p`.
  T at(Index3 p) {
    if (!is_known_) compute();
    return field_[static_cast<std::size_t>(cube_.offset(p))];
  }

 private:
  void compute() {
    std::vector<T> values(static_cast<std::size_t>(cube_.count()));
    LatticeBits active(cube_);
    std::size_t i = 0;
    for (std::int64_t z = cube_.low.z; z <= cube_.high.z; ++z)
      for (std::int64_t y = cube_.low.y; y <= cube_.high.y; ++y)
        for (std::int64_t x = cube_.low.x; x <= cube_.high.x; ++x, ++i) {
          if (!active_.test({x, y, z})) continue;
          active.set({x, y, z});
          values[i] = points_[static_cast<std::size_t>(active_.box().offset({x, y, z}))];
        }
    field_ = {};
    const auto field = interpolate_points<T>(values, active, cube_size_);
    field_ = rounded_field<T>(field, values, active, cube_size_);
    is_known_ = true;
  }

  std::span<const T> points_;
  const LatticeBits& active_;
  int cube_size_;
  Box cube_;
  bool is_known_ = false;
  std::vector<T> field_;
};

/// A leaf, or a piece of one, some of whose vertices are inside.
struct CrossedTetrahedron {
  std::array<BrickPoint, 4> vertices;  ///< in positive order
  unsigned inside = 0;                 ///< a bit for each vertex
  bool at_border = false;              ///< a vertex lies in the border of the volume
};

/// The tetrahedra that a surface crosses and, if it is to be closed, those at the border that are all inside.
/// Most of a brick is not visited: a cell whose active points lie on one side contains no crossing.
template <class T>
class Crossings {
 public:
  /// All of the arguments must outlive the object. See surface_of_brick().
  Crossings(std::span<T> points, const LatticeBits& active, const SurfaceGrid& grid,
            const SurfaceLevel& level)
      : values_(points),
        box_(active.box()),
        sides_(std::span<const T>(points), active, grid, level),
        points_(active.box().size()),
        grid_(grid),
        level_(level),
        deepest_(max_level(grid.cube_size)),
        field_(points, active, grid.cube_size) {}

  static std::uint64_t working_bytes(Index3 size, int cube_size) {
    return Sides::working_bytes(size) + FieldOfCube<T>::working_bytes(cube_size);
  }

  /// Calls visit(const CrossedTetrahedron&), in a fixed order. Vertices of pieces then have a value, too.
  template <class Visit>
  void for_each(Visit visit) {
    const int s = grid_.cube_size;
    for_each_point_of({box_.low, box_.high - Index3{1, 1, 1}}, s, [&](Index3 corner) {
      field_.begin(corner);
      for (const BisectionStep& root : root_tetrahedra(corner, s))
        descend<3>(packed(root.vertices), 0, root.negative, visit);
    });
  }

  double value(BrickPoint p) const { return value_at(number_of(p)); }
  Index3 place(BrickPoint p) const { return box_.low + points_[p]; }

  /// True if a tetrahedron with a NaN was left out.
  bool has_gaps() const { return has_gaps_; }

 private:
  // As for_each_leaf_below(). The base edge joins vertices 0 and `end`, which is 3 - level % 3.
  template <int end, class Visit>
  void descend(const std::array<BrickPoint, 4>& v, int level, bool negative, Visit& visit) {
    if (level == deepest_) return visit_leaf(v, negative, visit);
    const BrickPoint middle = (v[0] + v[end]) / 2;
    const std::uint8_t side = sides_[number_of(middle)];
    // The base edge of such a tetrahedron is the diagonal of the cell in which it lies.
    if (end == 3 && (side & Sides::crossed) == 0) return;
    if ((side & Sides::active) == 0) return visit_leaf(v, negative, visit);
    constexpr int next = end == 1 ? 3 : end - 1;
    std::array<BrickPoint, 4> half = v;
    half[end] = middle;
    descend<next>(half, level + 1, negative, visit);
    half = v;
    for (std::size_t i = 0; i < end; ++i) half[i] = v[i + 1];
    half[end] = middle;
    descend<next>(half, level + 1, negative != (end % 2 == 1), visit);
  }

  template <class Visit>
  void visit_leaf(const std::array<BrickPoint, 4>& v, bool negative, Visit& visit) {
    CrossedTetrahedron t{v};
    unsigned of_any = 0;
    for (unsigned i = 0; i < 4; ++i) {
      const unsigned side = sides_[number_of(v[i])];
      of_any |= side;
      t.inside |= static_cast<unsigned>((side & Sides::inside) != 0) << i;
    }
    t.at_border = (of_any & (Sides::border | Sides::beyond)) != 0;
    if (t.inside == 0 || (t.inside == 15 && !(grid_.close && t.at_border))) return;
    if (is_gap(t)) return;
    if (negative) {
      std::swap(t.vertices[2], t.vertices[3]);
      t.inside = (t.inside & 3) | (t.inside & 4) << 1 | (t.inside & 8) >> 1;
    }
    if ((of_any & Sides::beyond) != 0) return visit_pieces(t, visit);
    pass_on(t, visit);
  }

  template <class Visit>
  void visit_pieces(const CrossedTetrahedron& whole, Visit& visit) {
    for (const std::array<Index3, 4>& vertices : cut_at(places(whole), grid_.volume)) {
      CrossedTetrahedron piece{packed(vertices), 0, true};
      for (unsigned i = 0; i < 4; ++i) {
        const std::uint32_t number = number_of(piece.vertices[i]);
        piece.inside |= static_cast<unsigned>(is_inside(whole, number, vertices[i])) << i;
      }
      if (piece.inside != 0 && (piece.inside != 15 || grid_.close)) pass_on(piece, visit);
    }
  }

  // Where the border of the volume cuts an edge or a face of a leaf, the field gives the value. It is
  // rounded, and so decides on the side only if the ends of the edge, or the corners of the face, are not all
  // on one.
  bool is_inside(const CrossedTetrahedron& leaf, std::uint32_t number, Index3 place) {
    if (leaf.inside == 15) return true;
    if ((sides_[number] & Sides::active) != 0) return (sides_[number] & Sides::inside) != 0;
    values_[number] = field_.at(place);
    const std::array<Index3, 4> corners = places(leaf);
    unsigned around = 0;
    for (unsigned i = 0; i < 4; ++i) {
      std::array<Index3, 4> part = corners;
      part[i] = place;
      around |= static_cast<unsigned>(six_volumes(part) != 0) << i;
    }
    const unsigned inside_of_them = leaf.inside & around;
    if (inside_of_them == 0 || inside_of_them == around) return inside_of_them != 0;
    return level_.is_inside(value_at(number));
  }

  // True if a leaf is left out because it has a NaN.
  bool is_gap(const CrossedTetrahedron& t) {
    if (!std::is_floating_point_v<T> || grid_.close || t.inside == 15) return false;
    const bool gap = std::ranges::any_of(t.vertices, [&](BrickPoint p) { return std::isnan(value(p)); });
    has_gaps_ = has_gaps_ || gap;
    return gap;
  }

  template <class Visit>
  void pass_on(const CrossedTetrahedron& t, Visit& visit) const {
    if (!grid_.box || meets(places(t), *grid_.box)) visit(t);
  }

  std::array<Index3, 4> places(const CrossedTetrahedron& t) const {
    return {place(t.vertices[0]), place(t.vertices[1]), place(t.vertices[2]), place(t.vertices[3])};
  }
  std::array<BrickPoint, 4> packed(const std::array<Index3, 4>& v) const {
    return {points_.point(v[0] - box_.low), points_.point(v[1] - box_.low), points_.point(v[2] - box_.low),
            points_.point(v[3] - box_.low)};
  }

  double value_at(std::uint32_t number) const { return static_cast<double>(values_[number]); }

  std::span<T> values_;
  Box box_;
  Sides sides_;
  BrickPoints points_;
  const SurfaceGrid& grid_;
  const SurfaceLevel& level_;
  int deepest_;
  FieldOfCube<T> field_;
  bool has_gaps_ = false;
};

}  // namespace tagrid
