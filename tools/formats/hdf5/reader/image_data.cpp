#include "tools/formats/hdf5/reader/image_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "io/text/text.h"
#include "tools/formats/hdf5/attributes.h"
#include "tools/formats/hdf5/handle.h"
#include "tools/formats/hdf5/reader/fields.h"

namespace tagrid {
namespace {

constexpr const char* root = "/VTKHDF";
constexpr std::string_view point_data = "/VTKHDF/PointData/", cell_data = "/VTKHDF/CellData/";

Hdf5Handle opened_root(hid_t file) {
  if (H5Lexists(file, root, H5P_DEFAULT) <= 0) return {};
  return {H5Oopen(file, root, H5P_DEFAULT), H5Oclose};
}

/// Paths may be given without the first slash.
std::string absolute(const std::string& name) { return name.starts_with('/') ? name : "/" + name; }

bool are_nonzero(const std::vector<double>& numbers) {
  return are_finite(numbers) && std::ranges::count(numbers, 0.0) == 0;
}
bool are_directions(const std::vector<double>& numbers) {
  std::array<std::array<double, 3>, 3> rows = {};
  for (std::size_t i = 0; i < 9; ++i) rows[i / 3][i % 3] = numbers[i];
  const double volume = determinant(rows);
  return std::isfinite(volume) && volume != 0;
}

}  // namespace

std::string vtkhdf_type(hid_t file) {
  const Hdf5Handle group = opened_root(file);
  return group ? text_attribute(group.get(), "Type").value_or("") : "";
}

bool is_vtkhdf_array(const std::string& name) {
  return absolute(name).starts_with(point_data) || absolute(name).starts_with(cell_data);
}

std::optional<Geometry> geometry_of_image_data(hid_t file, const std::string& path, const std::string& name,
                                               const Index3& dims, std::vector<std::string>& warnings) {
  if (!is_vtkhdf_array(name) || vtkhdf_type(file) != "ImageData") return std::nullopt;
  const bool at_cells = absolute(name).starts_with(cell_data);
  const Hdf5Handle group = opened_root(file);
  constexpr const char* unknown = "where samples lie is not known";
  const std::string where = fmt::format("{}: VTKHDF file", path);
  Fields fields(group.get(), where);
  const auto extent = fields.numbers("WholeExtent", 6, unknown),
             origin = fields.numbers("Origin", 3, unknown),
             spacing = fields.numbers("Spacing", 3, unknown, are_nonzero),
             given_direction = fields.numbers("Direction", 9, unknown, are_directions);
  warnings.insert(warnings.end(), fields.warnings.begin(), fields.warnings.end());
  for (const auto& [attribute, found] :
       {std::pair("WholeExtent", &extent), std::pair("Origin", &origin), std::pair("Spacing", &spacing)})
    if (found->is_absent())
      warnings.push_back(fmt::format("{}: {} is missing; {}", where, attribute, unknown));
  if (!extent.is_number() || !origin.is_number() || !spacing.is_number() || given_direction.is_unreadable())
    return std::nullopt;
  const std::vector<double> none = {1, 0, 0, 0, 1, 0, 0, 0, 1},
                            direction = given_direction.is_number() ? given_direction.values : none;
  Geometry geometry;
  std::ranges::copy(origin.values, geometry.origin.begin());
  std::ranges::copy(spacing.values, geometry.spacing.begin());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double points = extent.values[2 * axis + 1] - extent.values[2 * axis] + 1;
    if (points - (at_cells ? 1 : 0) != static_cast<double>(dims[static_cast<int>(axis)])) {
      warnings.push_back(
          fmt::format("{}: WholeExtent has {} points along {}, which does not fit the {} samples of {}; {}",
                      where, points, "xyz"[axis], dims[static_cast<int>(axis)], name, unknown));
      return std::nullopt;
    }
    for (std::size_t row = 0; row < 3; ++row) {
      geometry.directions[axis][row] = direction[3 * row + axis] * spacing.values[axis];
      // Cells lie in the middle between points.
      geometry.origin[row] +=
          (extent.values[2 * axis] + (at_cells ? 0.5 : 0)) * geometry.directions[axis][row];
    }
  }
  geometry.has_directions = direction != none;
  geometry.has_spacing = geometry.has_origin = true;
  return geometry;
}

}  // namespace tagrid
