// Takes a surface of triangles piece by piece.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

namespace tagrid {

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
