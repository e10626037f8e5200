#include "io/vti/sink.h"

#include <fmt/format.h>

#include <array>

#include "io/bytes/little_endian.h"
#include "io/samples/file_sink.h"
#include "io/volume/vtk_geometry.h"
#include "io/volume/vtk_names.h"

namespace tagrid {
namespace {

std::string header_of(const VolumeInfo& info) {
  const VtkGeometry geometry = vtk_geometry_of(info.geometry);
  const std::string extent = fmt::format("0 {} 0 {} 0 {}", info.dims.x - 1, info.dims.y - 1, info.dims.z - 1);
  std::string text = fmt::format(
      "<?xml version=\"1.0\"?>\n"
      "<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n"
      "<ImageData WholeExtent=\"{}\" Origin=\"{}\" Spacing=\"{}\" Direction=\"{}\">\n"
      "<Piece Extent=\"{}\">\n"
      "<PointData Scalars=\"value\">\n"
      "<DataArray type=\"{}\" Name=\"value\" format=\"appended\" offset=\"0\"/>\n"
      "</PointData>\n</Piece>\n</ImageData>\n<AppendedData encoding=\"raw\">\n_",
      extent, fmt::join(geometry.origin, " "), fmt::join(geometry.spacing, " "),
      fmt::join(geometry.direction, " "), extent, vtk_name_of(info.type));
  std::array<std::byte, 8> bytes;
  store_little_endian(bytes.data(), *sample_bytes(info.dims, info.type));
  return text.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

}  // namespace

std::string lost_in_vti(const VolumeInfo& info) {
  if (info.nrrd_fields.find("rescale_slope:=") != std::string::npos)
    return "VTK's image data has no place for slope and intercept of its values: samples are written";
  if (has_unknown_spacing(info.geometry))
    return "VTK's image data cannot say that a spacing is not known; 1 is written";
  return "";
}

std::unique_ptr<VolumeSink> create_vti(const std::string& path, const VolumeInfo& info,
                                       const SinkOptions& options) {
  return std::make_unique<AttachedSink>(
      info, std::make_unique<OutputFile>(path, options.overwrite, output_options(options)), header_of(info),
      "\n</AppendedData>\n</VTKFile>\n");
}

}  // namespace tagrid
