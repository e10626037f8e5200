#include "io/meshes/mesh_formats.h"

#include "io/errors/errors.h"
#include "io/meshes/gmsh.h"
#include "io/meshes/vtkhdf.h"
#include "io/meshes/vtu.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

template <class File>
std::unique_ptr<MeshFile> create_mesh(const std::string& path, SampleType value_type, bool overwrite) {
  return std::make_unique<File>(path, value_type, overwrite);
}

// ParaView knows VTKHDF by the second of its extensions.
constexpr std::array formats_of_meshes = {
    MeshFormat{"VTU", {".vtu"}, create_mesh<VtuFile>},
    MeshFormat{"VTKHDF", {".vtkhdf", ".hdf"}, create_mesh<VtkhdfFile>, "hdf5", VtkhdfFile::memory_of_writer},
    MeshFormat{"Gmsh", {".msh"}, create_mesh<GmshFile>},
};

}  // namespace

std::span<const MeshFormat> mesh_formats() { return formats_of_meshes; }

const MeshFormat& mesh_format_of(const std::string& path) {
  if (path == "-") return formats_of_meshes.front();
  const std::string lower = lower_case(path);
  std::string names;
  for (const MeshFormat& format : formats_of_meshes)
    for (const std::string_view extension : format.extensions) {
      if (extension.empty()) continue;
      if (lower.ends_with(extension)) return format;
      names += std::string(names.empty() ? "" : &format == &formats_of_meshes.back() ? " or " : ", ");
      names += extension;
    }
  throw UsageError(path + ": the name of a mesh must end in " + names);
}

}  // namespace tagrid
