// The points around a candidate whose activity is known when the candidate is coded.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "stages/activity/candidates.h"
#include "stages/grid/box.h"

namespace tagrid {

/// Two kinds of neighbors of the points of a pass, as steps to them. Around: points of earlier passes that
/// are not parents. A cube centre looks at the points of the coarser lattice next to its cell, a face centre
/// at the cube centres beside its two parents, an edge midpoint at the face centres of the four cells around
/// it. Beside: points of the same class but another orientation that share a parent; cube centres have none.
class Surroundings {
 public:
  /// Steps to other points; no more than there can be around a point.
  struct Steps {
    std::array<Index3, 24> steps{};
    std::size_t size = 0;

    void add(Index3 step) { steps[size++] = step; }
    std::span<const Index3> all() const { return std::span(steps).first(size); }
  };

  Surroundings() = default;
  explicit Surroundings(const Pass& pass) {
    if (pass.odd_count == 3) of_cube_centre(pass.unit);
    if (pass.odd_count == 2) of_face_centre(pass);
    if (pass.odd_count == 1) of_edge_midpoint(pass);
  }

  std::span<const Index3> around() const { return around_.all(); }
  std::span<const Index3> beside() const { return beside_.all(); }

 private:
  void of_cube_centre(std::int64_t u) {
    for (int axis = 0; axis < 3; ++axis)
      for (const std::int64_t far : {-3 * u, 3 * u})
        for (const std::int64_t da : {-u, u})
          for (const std::int64_t db : {-u, u})
            around_.add(far * unit_vector(axis) + da * unit_vector((axis + 1) % 3) +
                        db * unit_vector((axis + 2) % 3));
  }

  void of_face_centre(const Pass& pass) {
    const std::int64_t u = pass.unit;
    const int normal = !pass.odd[0] ? 0 : !pass.odd[1] ? 1 : 2;
    for (int axis = 0; axis < 3; ++axis)
      if (axis != normal)
        for (const std::int64_t side : {-u, u})
          for (const std::int64_t step : {-u, u}) {
            around_.add(side * unit_vector(normal) + 2 * step * unit_vector(axis));
            beside_.add(side * unit_vector(normal) + step * unit_vector(axis));
          }
  }

  void of_edge_midpoint(const Pass& pass) {
    const std::int64_t u = pass.unit;
    const int along = pass.odd[0] ? 0 : pass.odd[1] ? 1 : 2, a = (along + 1) % 3, b = (along + 2) % 3;
    for (const std::int64_t da : {-u, u})
      for (const std::int64_t db : {-u, u}) {
        for (const std::int64_t dl : {-u, u})
          around_.add(dl * unit_vector(along) + da * unit_vector(a) + db * unit_vector(b));
        around_.add(2 * da * unit_vector(a) + db * unit_vector(b));
        around_.add(da * unit_vector(a) + 2 * db * unit_vector(b));
        beside_.add(da * unit_vector(along) + db * unit_vector(a));
        beside_.add(da * unit_vector(along) + db * unit_vector(b));
      }
  }

  Steps around_, beside_;
};

}  // namespace tagrid
