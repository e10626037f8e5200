#include "io/formats/vti/written.h"

#include <fmt/format.h>

#include <array>

#include "io/bytes/little_endian.h"
#include "io/metadata/lengths.h"
#include "io/text/text.h"
#include "io/volume/vtk.h"

namespace tagrid {

std::string vti_header(const VolumeInfo& info) {
  const VtkGeometry geometry = vtk_geometry_of(info.geometry());
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

std::string lost_rescale_in_image_data(const VolumeInfo& info) {
  return info.metadata.value("rescale_slope") ? "VTK's image data has no place for slope and intercept" : "";
}

std::vector<std::string> lost_in_image_data(const VolumeInfo& info) {
  std::vector<std::string> lost;
  const Geometry& geometry = info.geometry();
  if (std::string mixed = lost_by_mixed_units(geometry); !mixed.empty()) lost.push_back(std::move(mixed));
  if (has_unknown_spacing(geometry))
    lost.emplace_back("VTK's image data cannot record that a spacing is unknown; 1 is written");
  return lost;
}

std::vector<std::string> lost_in_vti(const VolumeInfo& info) {
  std::vector<std::string> lost = lost_in_image_data(info);
  const Geometry& geometry = info.geometry();
  const std::string unit = common_unit(in_one_unit(geometry)).name;
  std::vector<std::string> names;
  if (!geometry.space.empty())
    names.push_back(fmt::format("the space {}", quoted(std::string_view(geometry.space))));
  if (!unit.empty()) names.push_back(fmt::format("the unit {} of lengths", quoted(std::string_view(unit))));
  if (!names.empty())
    lost.push_back(fmt::format("VTK's image data does not name {}", fmt::join(names, " and ")));
  return lost;
}

}  // namespace tagrid
