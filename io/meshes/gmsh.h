// Meshes as binary Gmsh files of version 4.1 (.msh), for Gmsh and for solvers.
#pragma once

#include <cstdint>
#include <string>

#include "io/meshes/mesh_file.h"

namespace tagrid {

/// One volume with all tetrahedra; it is the physical group "volume", as some solvers want every element in a group.
/// Nodes and elements are numbered from 1 on, in the order in which they come. Node data `value`, and element data
/// `level` and `type`, are float64, which holds samples of every type exactly.
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
  void write_node_data();
  void write_rescaled_data();
  void write_element_data(const char* name, std::byte (*number_of)(std::byte level));
};

/// Throws UsageError if a file cannot have so many nodes, or elements: it numbers what has data with 32 bits.
void check_gmsh_count(std::int64_t count, const char* what, const std::string& name);

}  // namespace tagrid
