// Takes a mesh of tetrahedra piece by piece: a file, or an object of a caller of the library.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace tagrid {

class MeshSink {
 public:
  virtual ~MeshSink() = default;

  /// Takes more points. `xyz` has 3 coordinates per point, x y z; `values` has one sample per point, as the
  /// sample type lies in memory. The very first point has index 0. REQUIRES: as many values as points.
  virtual void add_points(std::span<const double> xyz, std::span<const std::byte> values) = 0;

  /// Takes more tetrahedra: for each, 4 point indices in positive order, and its level. Points may be added
  /// later. REQUIRES: connectivity.size() == 4 * levels.size().
  virtual void add_tetrahedra(std::span<const std::int64_t> connectivity,
                              std::span<const std::uint8_t> levels) = 0;
};

}  // namespace tagrid
