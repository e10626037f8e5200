// The formats of meshes and surfaces, as a table: a row for each format, with what its files hold.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "io/meshes/material_files.h"
#include "io/meshes/mesh_files.h"
#include "io/meshes/surface_files.h"

namespace tagrid {

/// A format of tetrahedra or of triangles: of meshes of the grid, of meshes with materials, or of surfaces.
struct MeshFormat {
  std::string_view name;
  std::array<std::string_view, 2> extensions;  ///< the second may be empty
  std::unique_ptr<MeshFile> (*create)(const std::string& path, SampleType value_type,
                                      bool overwrite) = nullptr;
  CreateMaterials create_materials = nullptr;
  std::unique_ptr<SurfaceFile> (*create_surface)(const std::string& path, bool overwrite) = nullptr;
  /// The program tagrid-write-WRITER writes it, with up to so many bytes of memory; "" if tagrid does so
  /// itself.
  std::string_view writer = "";
  std::uint64_t memory_of_writer = 0;
  /// The path of a second file that appears with the first one; nullptr if there is none.
  std::string (*second_file)(const std::string& path) = nullptr;
};

/// Those of meshes of the grid.
std::span<const MeshFormat> mesh_formats();
/// Those of meshes with materials.
std::span<const MeshFormat> material_mesh_formats();
std::span<const MeshFormat> surface_formats();

/// True if the name of a file has an extension of one of `formats`, in any case.
bool is_named_as_one_of(std::span<const MeshFormat> formats, std::string_view path);

/// The format that the name of a file says; VTU for "-". Throws UsageError if it says none.
const MeshFormat& mesh_format_of(const std::string& path);
/// The same for a mesh with materials.
const MeshFormat& material_mesh_format_of(const std::string& path);
/// The same for a surface; PLY for "-".
const MeshFormat& surface_format_of(const std::string& path);

}  // namespace tagrid
