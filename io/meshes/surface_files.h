// Surfaces of triangles as files. Only what is in all formats is here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "io/meshes/noted_file.h"
#include "io/meshes/sinks.h"

namespace tagrid {

/// A file of triangles. set_notes() comes before the first piece.
class SurfaceFile : public NotedFile, public SurfaceSink {
 public:
  using NotedFile::NotedFile;

 protected:
  /// Calls use(place) for each vertex that earlier pieces did not have, in order.
  template <class Use>
  void for_each_new_vertex(const SurfacePiece& piece, Use use) {
    for (std::size_t i = 0; i < piece.ids.size(); ++i) {
      if (piece.ids[i] < vertex_count_) continue;
      use(piece.position(i));
      ++vertex_count_;
    }
  }

  std::int64_t vertex_count_ = 0;
};

/// PLY, binary and little endian. Vertices are doubles: floats would move them by up to a tenth of a voxel if
/// the origin is far away. Faces are lists of three ints, as all readers expect, so there may be 2^31 - 1
/// vertices; WorldError if there are more.
std::unique_ptr<SurfaceFile> create_ply(const std::string& path, bool overwrite);

/// Binary STL, which has floats alone, and no shared vertices: each triangle has the places of its corners,
/// which are the same bits in all triangles of a vertex. Normals are computed from them; a triangle without
/// an area has the normal 0. There may be 2^32 - 1 triangles; WorldError if there are more. Warns if floats
/// are too coarse for the positions of the corners.
std::unique_ptr<SurfaceFile> create_stl(const std::string& path, bool overwrite);

/// Wavefront OBJ, which is text. Coordinates have as many digits as lead back to the same doubles.
std::unique_ptr<SurfaceFile> create_obj(const std::string& path, bool overwrite);

/// VTK XML polygonal data (.vtp), for ParaView and VTK. Appended raw data, header_type="UInt64", little
/// endian: Float64 points, Int64 connectivity and offsets.
std::unique_ptr<SurfaceFile> create_vtp(const std::string& path, bool overwrite);

}  // namespace tagrid
