// Surfaces as binary STL.
#pragma once

#include <cstdint>
#include <string>

#include "io/meshes/counted_output.h"
#include "io/meshes/surface_file.h"

namespace tagrid {

/// STL has floats alone, and no shared vertices: each triangle has the places of its corners, which are the
/// same bits in all triangles of a vertex. Normals are computed from them; a triangle without an area has the
/// normal 0. There may be 2^32 - 1 triangles; WorldError if there are more.
class StlFile : public SurfaceFile {
 public:
  StlFile(const std::string& path, bool overwrite);

  void add(const SurfacePiece& piece) override;
  void finish() override;
  /// Warns if floats are too coarse for the positions of the corners.
  std::vector<std::string> warnings() const override;

 private:
  CountedOutput triangles_;
  std::uint64_t count_ = 0;
  double rounding_ = 0;  ///< the largest difference between a coordinate and its float
};

}  // namespace tagrid
