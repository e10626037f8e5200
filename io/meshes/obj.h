// Surfaces as Wavefront OBJ, which is text.
#pragma once

#include <cstdint>
#include <string>

#include "io/meshes/surface_file.h"

namespace tagrid {

/// Coordinates have as many digits as lead back to the same doubles. Vertices and faces alternate, so nothing waits.
class ObjFile : public SurfaceFile {
 public:
  using SurfaceFile::SurfaceFile;

  void add(const SurfacePiece& piece) override;
  void finish() override;

 private:
  void begin();
  void flush(std::size_t most);

  bool has_begun_ = false;
  std::string text_;
  std::int64_t vertex_count_ = 0;
};

}  // namespace tagrid
