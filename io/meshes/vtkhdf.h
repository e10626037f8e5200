// Meshes as VTKHDF unstructured grids (.vtkhdf), for ParaView and VTK. The program tagrid-write-hdf5 writes them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "io/meshes/mesh_file.h"

namespace tagrid {

/// The arrays are those of VtuFile.
class VtkhdfFile final : public MeshFile {
 public:
  /// Throws WorldError, too, if the program is not installed.
  VtkhdfFile(const std::string& path, SampleType value_type, bool overwrite);

  /// The most bytes of memory that the program may take.
  static constexpr std::uint64_t memory_of_writer = std::uint64_t{96} << 20;

  std::uint64_t file_bytes() const override { return bytes_; }
  std::vector<std::string> warnings() const override { return warnings_; }

 private:
  void write_mesh() override;

  std::string path_, program_;
  std::uint64_t bytes_ = 0;
  std::vector<std::string> warnings_;
};

}  // namespace tagrid
