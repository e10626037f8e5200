// The points around a candidate whose activity is known when the candidate is coded.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>

#include "stages/activity/candidates.h"
#include "stages/grid/lattice_bits.h"

namespace tagrid {

/// A set of neighbours of the points of a pass.
struct Neighbours {
  std::array<Index3, 24> steps{};
  std::array<std::int64_t, 24> bits{};  ///< the same, as distances in the words of LatticeBits
  std::size_t size = 0;
};

/// Counts two kinds of neighbours. Around: points of earlier passes that are not parents. A cube centre looks
/// at the points of the coarser lattice next to its cell, a face centre at the cube centres beside its two
/// parents, an edge midpoint at the face centres of the four cells around it. Siblings: points of the same
/// class but another orientation that share a parent.
class Surroundings {
 public:
  /// REQUIRES: `active` outlives this.
  Surroundings(const LatticeBits& active, const Pass& pass) : active_(active) {
    const auto row = static_cast<std::int64_t>(active.words_per_row()) * 64;
    stride_ = {1, row, row * active.box().size().y};
    if (pass.odd_count == 3) of_cube_centre(pass.unit);
    if (pass.odd_count == 2) of_face_centre(pass);
    if (pass.odd_count == 1) of_edge_midpoint(pass);
  }

  struct Counts {
    std::size_t around, siblings;
  };
  /// The numbers of active neighbours; points outside the box count as inactive.
  Counts count_active(Index3 p) const {
    const bool inside = active_.box().contains(Box{p, p}.grown(reach_));
    return {inside ? count_inside(around_, p) : count_in_box(around_, p),
            inside ? count_inside(siblings_, p) : count_in_box(siblings_, p)};
  }

 private:
  std::size_t count_inside(const Neighbours& neighbours, Index3 p) const {
    const std::int64_t at = position(p - active_.box().low);
    const std::uint64_t* words = active_.words().data();
    std::size_t count = 0;
    for (std::size_t i = 0; i < neighbours.size; ++i) {
      const auto bit = static_cast<std::size_t>(at + neighbours.bits[i]);
      count += (words[bit / 64] >> (bit % 64)) & 1;
    }
    return count;
  }

  std::size_t count_in_box(const Neighbours& neighbours, Index3 p) const {
    std::size_t count = 0;
    for (std::size_t i = 0; i < neighbours.size; ++i) {
      const Index3 q = p + neighbours.steps[i];
      count += active_.box().contains(q) && active_.test(q);
    }
    return count;
  }

  std::int64_t position(Index3 d) const { return d.x + d.y * stride_.y + d.z * stride_.z; }

  void add(Neighbours& neighbours, Index3 step) {
    neighbours.steps[neighbours.size] = step;
    neighbours.bits[neighbours.size] = position(step);
    ++neighbours.size;
    for (int axis = 0; axis < 3; ++axis) reach_ = std::max(reach_, std::abs(step[axis]));
  }

  void of_cube_centre(std::int64_t u) {
    for (int axis = 0; axis < 3; ++axis)
      for (const std::int64_t far : {-3 * u, 3 * u})
        for (const std::int64_t da : {-u, u})
          for (const std::int64_t db : {-u, u})
            add(around_, far * unit_vector(axis) + da * unit_vector((axis + 1) % 3) +
                             db * unit_vector((axis + 2) % 3));
    for (int axis = 0; axis < 3; ++axis)  // cells before, across an edge
      for (const std::int64_t da : {-2 * u, 2 * u})
        for (const std::int64_t db : {-2 * u, 2 * u})
          add(siblings_, da * unit_vector((axis + 1) % 3) + db * unit_vector((axis + 2) % 3));
  }

  void of_face_centre(const Pass& pass) {
    const std::int64_t u = pass.unit;
    const int normal = !pass.odd[0] ? 0 : !pass.odd[1] ? 1 : 2;
    for (int axis = 0; axis < 3; ++axis)
      if (axis != normal)
        for (const std::int64_t side : {-u, u})
          for (const std::int64_t step : {-u, u}) {
            add(around_, side * unit_vector(normal) + 2 * step * unit_vector(axis));
            add(siblings_, side * unit_vector(normal) + step * unit_vector(axis));
          }
  }

  void of_edge_midpoint(const Pass& pass) {
    const std::int64_t u = pass.unit;
    const int along = pass.odd[0] ? 0 : pass.odd[1] ? 1 : 2, a = (along + 1) % 3, b = (along + 2) % 3;
    for (const std::int64_t da : {-u, u})
      for (const std::int64_t db : {-u, u}) {
        for (const std::int64_t dl : {-u, u})
          add(around_, dl * unit_vector(along) + da * unit_vector(a) + db * unit_vector(b));
        add(around_, 2 * da * unit_vector(a) + db * unit_vector(b));
        add(around_, da * unit_vector(a) + 2 * db * unit_vector(b));
        add(siblings_, da * unit_vector(along) + db * unit_vector(a));
        add(siblings_, da * unit_vector(along) + db * unit_vector(b));
      }
  }

  const LatticeBits& active_;
  Index3 stride_;
  Neighbours around_, siblings_;
  std::int64_t reach_ = 0;
};

}  // namespace tagrid
