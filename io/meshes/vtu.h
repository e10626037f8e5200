// Meshes as VTK XML unstructured grids (.vtu), for ParaView and VTK.
#pragma once

#include <cstdint>
#include <string>

#include "io/meshes/mesh_file.h"

namespace tagrid {

/// The file has appended raw data, header_type="UInt64", little endian: Float64 points, Int64 connectivity
/// and offsets, UInt8 types (10, VTK_TETRA); point data `value` of the sample type and, if that has a slope or an intercept,
/// `rescaled` (Float64); cell data `level` and
/// `type` (level % 3: the primitives I, II, III), both UInt8.
class VtuFile final : public MeshFile {
 public:
  using MeshFile::MeshFile;

 private:
  void write_mesh() override;
  std::string head() const;
};

}  // namespace tagrid
