// Take a mesh of tetrahedra, or a surface of triangles, piece by piece: a file, or an object of a caller of
// the library.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
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

/// Some triangles, and their vertices, each once.
struct SurfacePiece {
  /// The numbers of the vertices in the entire surface, in the order in which vertices come: those of earlier
  /// pieces have lower numbers than all new ones, and the new ones follow one another.
  std::span<const std::int64_t> ids;
  /// The position of a vertex of the piece in the world: x y z.
  std::function<std::array<double, 3>(std::size_t)> position;
  /// Vertices of the piece, counterclockwise if seen from outside.
  std::span<const std::array<std::uint32_t, 3>> triangles;
};

class SurfaceSink {
 public:
  virtual ~SurfaceSink() = default;

  virtual void add(const SurfacePiece& piece) = 0;
};

}  // namespace tagrid
