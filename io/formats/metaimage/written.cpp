// MetaImage headers of volumes that are written.
#include <fmt/format.h>

#include <array>

#include "io/errors/errors.h"
#include "io/formats/metaimage/header.h"
#include "io/metadata/foreign_geometry.h"
#include "io/metadata/lengths.h"
#include "io/metadata/loss.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

/// From the space of the volume to left-posterior-superior: the sign of each axis of the world.
std::array<double, 3> signs_of(const Geometry& geometry) {
  const auto signs = signs_of_space(geometry.space);
  if (!signs) return {1, 1, 1};
  return {-1.0 * (*signs)[0], -1.0 * (*signs)[1], 1.0 * (*signs)[2]};
}

std::string geometry_lines(const Geometry& geometry) {
  std::array<double, 3> spacing;
  for (std::size_t axis = 0; axis < 3; ++axis) spacing[axis] = spacing_or_1(geometry, axis);
  std::string lines;
  if (geometry.has_directions || geometry.has_origin || geometry.origin != Geometry().origin) {
    const std::array<double, 3> signs = signs_of(geometry);
    std::array<double, 9> matrix = {};
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::size_t row = 0; row < 3; ++row) {
        const double direction =
            geometry.has_directions ? geometry.directions[axis][row] / spacing[axis] : axis == row;
        matrix[3 * axis + row] = direction == 0 ? 0 : direction * signs[row];
      }
    lines += fmt::format("TransformMatrix = {}\n", fmt::join(matrix, " "));
    std::array<double, 3> origin;
    for (std::size_t row = 0; row < 3; ++row)
      origin[row] = geometry.origin[row] == 0 ? 0 : geometry.origin[row] * signs[row];
    lines += fmt::format("Offset = {}\n", fmt::join(origin, " "));
  }
  if (geometry.has_spacing || !lines.empty())
    lines += fmt::format("ElementSpacing = {}\n", fmt::join(spacing, " "));
  return lines;
}

/// True if a MetaImage source had this unit: other programs have already read these numbers with it.
bool has_unit_of_source(const VolumeInfo& info) {
  const std::string unit = info.metadata.text_of("metaimage_DistanceUnits");
  return !unit.empty() && info.geometry().units == std::array{unit, unit, unit};
}

/// In millimeters if the units are known, because ITK and its users take all lengths as millimeters.
Geometry geometry_in_file(const VolumeInfo& info) {
  if (has_unit_of_source(info) || !common_unit(info.geometry()).is_known) return info.geometry();
  return in_unit(info.geometry(), "mm");
}

std::string header_of(const VolumeInfo& info, const std::string& data_file) {
  const Geometry geometry = geometry_in_file(info);
  std::string text = fmt::format(
      "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = "
      "False\n");
  text += geometry_lines(geometry);
  std::string slope, intercept;
  bool has_slopes_of_slices = false;
  for (const auto& [key, value] : info.metadata.pairs()) {
    constexpr std::string_view ours = "metaimage_";
    has_slopes_of_slices = has_slopes_of_slices || key == "slice_slopes";
    if (key == "rescale_slope") slope = value;
    if (key == "rescale_intercept") intercept = value;
    if (key == lossy_source_key && value.find('\n') == value.npos)
      text += fmt::format("{} = {}\n", meta_image_loss, value);
    // A value is the rest of its line.
    if (!key.starts_with(ours) || value.find('\n') != value.npos) continue;
    const std::string name = key.substr(ours.size());
    if (lower_case(name).starts_with("elementtointensityfunction") || is_read_meta_image_field(name))
      continue;
    if (name == "DistanceUnits" && !has_unit_of_source(info)) continue;
    text += fmt::format("{} = {}\n", name, value);
  }
  if (!has_unit_of_source(info) && common_unit(geometry).is_known) text += "DistanceUnits = mm\n";
  if (!slope.empty() && !has_slopes_of_slices)
    text += fmt::format("ElementToIntensityFunctionSlope = {}\nElementToIntensityFunctionOffset = {}\n",
                        slope, intercept);
  text += fmt::format("DimSize = {} {} {}\nElementType = {}\nElementDataFile = {}\n", info.dims.x,
                      info.dims.y, info.dims.z, meta_image_name_of(info.type), data_file);
  return text;
}

}  // namespace

std::string meta_image_header_text(const VolumeInfo& info) { return header_of(info, "LOCAL"); }

std::string detached_meta_image_header(const VolumeInfo& info, const std::string& data_file) {
  std::string text = header_of(info, data_file);
  // Some names have another meaning in a header.
  if (parse_meta_image_header(text).data_files == std::vector{data_file}) return text;
  throw UsageError(tagrid::quoted(data_file) +
                   ": a MetaImage header cannot refer to a file of this name; choose another name");
}

std::vector<std::string> lost_in_meta_image(const VolumeInfo& info) {
  return lost_places(
      info.geometry(),
      {.name = "MetaImage",
       .space = "left-posterior-superior",
       .unknown_unit = "the numbers are written as they are, and programs take them for millimeters"});
}

}  // namespace tagrid
