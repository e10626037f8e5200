#include "io/meshes/formats.h"

#include "io/errors/errors.h"
#include "io/meshes/mesh_files.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

template <class File>
std::unique_ptr<MeshFile> create_mesh(const std::string& path, SampleType value_type, bool overwrite) {
  return std::make_unique<File>(path, value_type, overwrite);
}

// ParaView knows VTKHDF by the second of its extensions.
constexpr std::array formats = {
    MeshFormat{.name = "VTU", .extensions = {".vtu"}, .create = create_mesh<VtuFile>},
    MeshFormat{.name = "VTKHDF",
               .extensions = {".vtkhdf", ".hdf"},
               .create = create_mesh<VtkhdfFile>,
               .writer = "hdf5",
               .memory_of_writer = VtkhdfFile::memory_of_writer},
    MeshFormat{.name = "Gmsh", .extensions = {".msh"}, .create = create_mesh<GmshFile>},
    MeshFormat{.name = "PLY", .extensions = {".ply"}, .create_surface = create_ply},
    MeshFormat{.name = "STL", .extensions = {".stl"}, .create_surface = create_stl},
    MeshFormat{.name = "OBJ", .extensions = {".obj"}, .create_surface = create_obj},
    MeshFormat{.name = "VTP", .extensions = {".vtp"}, .create_surface = create_vtp},
};
// Surfaces follow.
constexpr auto meshes = static_cast<std::size_t>(
    std::ranges::count_if(formats, [](const MeshFormat& format) { return format.create != nullptr; }));

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
  throw UsageError(path + ": the name of a " + std::string(what) + " must end in " + names);
}

}  // namespace

std::span<const MeshFormat> mesh_formats() { return std::span(formats).first(meshes); }
std::span<const MeshFormat> surface_formats() { return std::span(formats).subspan(meshes); }

bool is_named_as_one_of(std::span<const MeshFormat> known, std::string_view path) {
  const std::string lower = lower_case(path);
  for (const MeshFormat& format : known)
    for (const std::string_view extension : format.extensions)
      if (!extension.empty() && lower.ends_with(extension)) return true;
  return false;
}

const MeshFormat& mesh_format_of(const std::string& path) { return format_of(path, mesh_formats(), "mesh"); }

const MeshFormat& surface_format_of(const std::string& path) {
  return format_of(path, surface_formats(), "surface");
}

}  // namespace tagrid
