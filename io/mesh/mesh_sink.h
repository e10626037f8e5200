// Where a mesh of tetrahedra goes, piece by piece: a file, or whatever a caller of the library makes of it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace tagrid {

class MeshSink {
 public:
  virtual ~MeshSink() = default;

  /// Takes more points: `xyz` has 3 coordinates a point, x y z; `values` one sample a point, as the sample
  /// type lies in memory. The first point of all has index 0. REQUIRES: as many values as points.
  virtual void add_points(std::span<const double> xyz, std::span<const std::byte> values) = 0;

  /// Takes more tetrahedra: 4 point indices each, in positive order, and their levels. Points may be added
  /// later. REQUIRES: connectivity.size() == 4 * levels.size().
  virtual void add_tetrahedra(std::span<const std::int64_t> connectivity,
                              std::span<const std::uint8_t> levels) = 0;
};

}  // namespace tagrid
