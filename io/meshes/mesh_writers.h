// Writers of formats that hold meshes of the grid as well as meshes with materials.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "io/files/output_file.h"
#include "io/meshes/mesh_contents.h"

namespace tagrid {

/// Writes a VTK XML unstructured grid (.vtu).
///
/// Appended raw data, header_type="UInt64", little endian: Float64 points, Int64 connectivity and offsets, UInt8
/// types (10, VTK_TETRA, or 24, VTK_QUADRATIC_TETRA), and the data.
void write_vtu(OutputFile& output, const MeshContents& mesh);

/// A volume or a surface of a Gmsh file, which is a physical group with the same name: cells or faces `first` up to
/// `first + count`.
struct GmshGroup {
  std::string name;
  int tag = 1;  ///< of the physical group; that of the entity is its place, from 1 on
  std::int64_t first = 0, count = 0;
  /// For a volume: its surfaces, by their places from 1 on; negative if their faces are turned inwards.
  std::vector<int> surfaces = {};
};

struct GmshGroups {
  std::vector<GmshGroup> volumes, surfaces;
  SpoolFile* face_nodes = nullptr;  ///< of surfaces; see MaterialMesh
};

/// Writes a binary Gmsh file of version 4.1 (.msh).
///
/// Nodes, cells, and then faces are numbered from 1 on, in the order in which they come. All nodes are in one block,
/// which is that of the first volume, as if they were inside; all entities have the bounds of the mesh.
void write_gmsh(OutputFile& output, const MeshContents& mesh, const GmshGroups& groups);

/// Throws UsageError if a file cannot have so many nodes, or elements: it numbers what has data with 32 bits.
void check_gmsh_count(std::int64_t count, const char* what, const std::string& name);

/// Has the program tagrid-write-hdf5 write a mesh.
class Hdf5MeshWriter {
 public:
  /// The most bytes of memory that the program may take.
  static constexpr std::uint64_t memory_of_writer = std::uint64_t{96} << 20;

  /// `output` must outlive the object, and nothing has been written to it. `path`: its own. `format`: its name, for
  /// messages. Throws WorldError if the program is not installed.
  Hdf5MeshWriter(OutputFile& output, const std::string& path, const std::string& format);

  /// Writes all of the file. `layout`: "vtkhdf", or "xdmf".
  void write(const MeshContents& mesh, const std::string& layout);

  /// Of the complete file.
  std::uint64_t bytes() const { return bytes_; }
  std::vector<std::string> warnings() const { return warnings_; }

 private:
  OutputFile& output_;
  std::string path_, program_;
  std::uint64_t bytes_ = 0;
  std::vector<std::string> warnings_;
};

}  // namespace tagrid
