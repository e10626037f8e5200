// The formats of meshes of tetrahedra.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "io/meshes/mesh_file.h"

namespace tagrid {

/// VTK XML unstructured grids (.vtu), for ParaView and VTK.
///
/// The file has appended raw data, header_type="UInt64", little endian: Float64 points, Int64 connectivity
/// and offsets, UInt8 types (10, VTK_TETRA); point data `value` of the sample type and, if that has a slope
/// or an intercept, `rescaled` (Float64); cell data `level` and `type` (level % 3: the primitives I, II,
/// III), both UInt8.
class VtuFile final : public MeshFile {
 public:
  using MeshFile::MeshFile;

 private:
  void write_mesh() override;
  std::string head() const;
};

/// VTKHDF unstructured grids (.vtkhdf), for ParaView and VTK. The program tagrid-write-hdf5 writes them.
///
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

/// Binary Gmsh files of version 4.1 (.msh), for Gmsh and for solvers.
///
/// One volume with all tetrahedra; it is the physical group "volume", as some solvers want every element in a
/// group. Nodes and elements are numbered from 1 on, in the order in which they come. Node data `value`, and
/// element data `level` and `type`, are float64, which holds samples of every type exactly.
class GmshFile final : public MeshFile {
 public:
  using MeshFile::MeshFile;

  /// Both throw UsageError if there are more than the format can have.
  void add_points(std::span<const double> xyz, std::span<const std::byte> values) override;
  void add_tetrahedra(std::span<const std::int64_t> connectivity,
                      std::span<const std::uint8_t> levels) override;

 private:
  void write_mesh() override;
  void write_entities();
  void write_nodes();
  void write_elements();
  /// `pass_numbers` passes the numbers of all nodes or elements to a function.
  template <class Pass>
  void write_data(const char* section, const char* name, std::int64_t count, Pass pass_numbers);
  void write_data_of_nodes();
  void write_data_of_elements(const char* name, std::byte (*number_of)(std::byte level));
};

/// Throws UsageError if a file cannot have so many nodes, or elements: it numbers what has data with 32 bits.
void check_gmsh_count(std::int64_t count, const char* what, const std::string& name);

}  // namespace tagrid
