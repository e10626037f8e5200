#include "io/meshes/surface_file.h"

#include <array>

#include "io/errors/errors.h"
#include "io/meshes/obj.h"
#include "io/meshes/ply.h"
#include "io/meshes/stl.h"
#include "io/meshes/vtp.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

template <class File>
std::unique_ptr<SurfaceFile> create(const std::string& path, bool overwrite) {
  return std::make_unique<File>(path, overwrite);
}

constexpr std::array formats = {
    SurfaceFormat{"PLY", ".ply", create<PlyFile>},
    SurfaceFormat{"STL", ".stl", create<StlFile>},
    SurfaceFormat{"OBJ", ".obj", create<ObjFile>},
    SurfaceFormat{"VTP", ".vtp", create<VtpFile>},
};

}  // namespace

std::span<const SurfaceFormat> surface_formats() { return formats; }

const SurfaceFormat& surface_format_of(const std::string& path) {
  if (path == "-") return formats.front();
  const std::string lower = lower_case(path);
  std::string names;
  for (const SurfaceFormat& format : formats) {
    if (lower.ends_with(format.extension)) return format;
    names += std::string(names.empty() ? "" : &format == &formats.back() ? " or " : ", ");
    names += format.extension;
  }
  throw UsageError(path + ": the name of a surface must end in " + names);
}

}  // namespace tagrid
