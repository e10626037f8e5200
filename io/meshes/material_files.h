// Files of meshes with materials. Only what is in all formats is here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <string_view>

#include "io/meshes/material_mesh.h"
#include "io/meshes/noted_file.h"

namespace tagrid {

/// What files of a format can number and name.
struct FormatLimits {
  std::string_view format;                                       ///< its name
  std::int64_t most = std::numeric_limits<std::int64_t>::max();  ///< points, and tetrahedra
  std::size_t longest_name = std::numeric_limits<std::size_t>::max();
};
inline constexpr FormatLimits abaqus_limits = {"Abaqus", 999'999'999, 80};
/// Nothing has data, so numbers have 64 bits.
inline constexpr FormatLimits gmsh_limits = {.format = "Gmsh", .longest_name = 127};
/// Numbers are ints.
inline constexpr FormatLimits febio_limits = {.format = "FEBio",
                                              .most = std::numeric_limits<std::int32_t>::max()};
/// Numbers are ints. Names are in comments; lines of some readers have up to 255 characters.
inline constexpr FormatLimits medit_limits = {"Medit", std::numeric_limits<std::int32_t>::max(), 200};

/// A file of a mesh with materials.
class MaterialMeshFile : public WholeFile {
 public:
  using WholeFile::WholeFile;

  /// Writes all of the file, once. Memory does not grow with the mesh. Throws UsageError if the format cannot hold the
  /// mesh.
  virtual void write(MaterialMesh& mesh) = 0;
};

/// Throws UsageError if the output exists and `overwrite` is false.
using CreateMaterials = std::unique_ptr<MaterialMeshFile> (*)(const std::string& path, bool overwrite);

/// VTK XML (.vtu) and VTKHDF (.vtkhdf), for ParaView and VTK; see contents_of() for the arrays. Surfaces are not
/// written: a file has one kind of cells.
std::unique_ptr<MaterialMeshFile> create_vtu_materials(const std::string& path, bool overwrite);
std::unique_ptr<MaterialMeshFile> create_vtkhdf_materials(const std::string& path, bool overwrite);

/// XDMF (.xdmf), which is text, and a file with the extension .h5 beside it, which has the numbers: the data sets
/// /points, /tetrahedra and /material. Both get their names together. It has no surfaces.
std::string path_of_xdmf_numbers(const std::string& path);
std::unique_ptr<MaterialMeshFile> create_xdmf(const std::string& path, bool overwrite);

/// Binary Gmsh files of version 4.1 (.msh), for Gmsh, FEniCS and others; see write_gmsh(). Each material is a volume,
/// and each surface a surface; physical groups have their names. Groups of volumes have the labels as tags, if these
/// are positive, have 31 bits and differ; otherwise, and for surfaces, tags are places from 1 on.
std::unique_ptr<MaterialMeshFile> create_gmsh_materials(const std::string& path, bool overwrite);

/// Abaqus (.inp), which CalculiX reads, too: nodes, an element set for each material, and facet_sets(): each is a
/// surface of faces of elements, and those of both sides are a set of nodes, too. Nodes and elements are numbered from
/// 1 on. Numbers have up to 20 characters, which is what both programs read: most coordinates then come back exactly,
/// others with 13 digits or more.
std::unique_ptr<MaterialMeshFile> create_abaqus(const std::string& path, bool overwrite);

/// FEBio (.feb) of version 4.0: a part and a solid domain for each material, facet_sets() as surfaces and sets of nodes,
/// and for each material a placeholder of its properties, which users must replace.
std::unique_ptr<MaterialMeshFile> create_febio(const std::string& path, bool overwrite);

/// Medit (.mesh), which is text: tetrahedra with the label of their material as reference, and triangles with the place
/// of their surface, from 1 on. Comments at the beginning have the names. Elements of order 2 are TetrahedraP2 and
/// TrianglesP2, with their nodes in the order of MaterialMesh, as Gmsh has them, too.
std::unique_ptr<MaterialMeshFile> create_medit(const std::string& path, bool overwrite);

}  // namespace tagrid
