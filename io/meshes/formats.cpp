#include "io/meshes/formats.h"

#include <fmt/format.h>

#include <algorithm>

#include "io/errors/errors.h"
#include "io/meshes/mesh_files.h"
#include "io/meshes/mesh_writers.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

template <class File>
std::unique_ptr<MeshFile> create_mesh(const std::string& path, SampleType value_type, bool overwrite) {
  return std::make_unique<File>(path, value_type, overwrite);
}

// First come formats of meshes of the grid, which hold materials as well, then those of materials alone, then surfaces.
// ParaView knows VTKHDF by the second of its extensions.
constexpr std::array formats = {
    MeshFormat{.name = "VTU",
               .extensions = {".vtu"},
               .create = create_mesh<VtuFile>,
               .create_materials = create_vtu_materials},
    MeshFormat{.name = "VTKHDF",
               .extensions = {".vtkhdf", ".hdf"},
               .create = create_mesh<VtkhdfFile>,
               .create_materials = create_vtkhdf_materials,
               .writer = "hdf5",
               .memory_of_writer = Hdf5MeshWriter::memory_of_writer},
    MeshFormat{.name = "Gmsh",
               .extensions = {".msh"},
               .create = create_mesh<GmshFile>,
               .create_materials = create_gmsh_materials},
    MeshFormat{.name = "Abaqus", .extensions = {".inp"}, .create_materials = create_abaqus},
    MeshFormat{.name = "FEBio", .extensions = {".feb"}, .create_materials = create_febio},
    MeshFormat{.name = "Medit", .extensions = {".mesh"}, .create_materials = create_medit},
    MeshFormat{.name = "XDMF",
               .extensions = {".xdmf"},
               .create_materials = create_xdmf,
               .writer = "hdf5",
               .memory_of_writer = Hdf5MeshWriter::memory_of_writer,
               .second_file = path_of_xdmf_numbers},
    MeshFormat{.name = "PLY", .extensions = {".ply"}, .create_surface = create_ply},
    MeshFormat{.name = "STL", .extensions = {".stl"}, .create_surface = create_stl},
    MeshFormat{.name = "OBJ", .extensions = {".obj"}, .create_surface = create_obj},
    MeshFormat{.name = "VTP", .extensions = {".vtp"}, .create_surface = create_vtp},
};
constexpr auto meshes = static_cast<std::size_t>(
    std::ranges::count_if(formats, [](const MeshFormat& format) { return format.create != nullptr; }));
constexpr auto with_materials = static_cast<std::size_t>(std::ranges::count_if(
    formats, [](const MeshFormat& format) { return format.create_materials != nullptr; }));

/// What files of the format hold that the name of the file says; "" if it says none.
std::string about_format(const std::string& path) {
  for (const MeshFormat& format : formats)
    if (is_named_as_one_of(std::span(&format, 1), path))
      return fmt::format("{} files hold {} only; ", format.name,
                         format.create             ? "meshes"
                         : format.create_materials ? "meshes with materials"
                                                   : "surfaces");
  return "";
}

const MeshFormat& format_of(const std::string& path, std::span<const MeshFormat> known,
                            std::string_view what) {
  if (path == "-") return known.front();
  const std::string lower = lower_case(path);
  std::string names;
  for (const MeshFormat& format : known)
    for (const std::string_view extension : format.extensions) {
      if (extension.empty()) continue;
      if (lower.ends_with(extension)) return format;
      names += std::string(names.empty() ? "" : &format == &known.back() ? " or " : ", ");
      names += extension;
    }
  throw UsageError(
      fmt::format("{}: {}the name of a {} must end in {}", path, about_format(path), what, names));
}

}  // namespace

std::span<const MeshFormat> mesh_formats() { return std::span(formats).first(meshes); }
std::span<const MeshFormat> material_mesh_formats() { return std::span(formats).first(with_materials); }
std::span<const MeshFormat> surface_formats() { return std::span(formats).subspan(with_materials); }

bool is_named_as_one_of(std::span<const MeshFormat> known, std::string_view path) {
  const std::string lower = lower_case(path);
  for (const MeshFormat& format : known)
    for (const std::string_view extension : format.extensions)
      if (!extension.empty() && lower.ends_with(extension)) return true;
  return false;
}

const MeshFormat& mesh_format_of(const std::string& path) { return format_of(path, mesh_formats(), "mesh"); }

const MeshFormat& material_mesh_format_of(const std::string& path) {
  return format_of(path, material_mesh_formats(), "mesh with materials");
}

const MeshFormat& surface_format_of(const std::string& path) {
  return format_of(path, surface_formats(), "surface");
}

}  // namespace tagrid
