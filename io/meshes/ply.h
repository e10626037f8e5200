// Surfaces as PLY, binary and little endian.
#pragma once

#include <cstdint>
#include <string>

#include "io/files/spool_file.h"
#include "io/meshes/counted_output.h"
#include "io/meshes/surface_file.h"

namespace tagrid {

/// Vertices are doubles: floats would move them by up to a tenth of a voxel if the origin is far away. Faces are lists
/// of three ints, as all readers expect, so there may be 2^31 - 1 vertices; WorldError if there are more. A comment of spaces gives the head a fixed
/// size.
class PlyFile : public SurfaceFile {
 public:
  PlyFile(const std::string& path, bool overwrite);

  void add(const SurfacePiece& piece) override;
  void finish() override;

 private:
  CountedOutput vertices_;
  SpoolFile faces_;
  std::int64_t vertex_count_ = 0;
};

}  // namespace tagrid
