#include "tools/readers/hdf5/image_data.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tools/hdf5/attributes.h"
#include "tools/hdf5/handle.h"

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

}  // namespace

std::string vtkhdf_type(hid_t file) {
  const Hdf5Handle group = opened_root(file);
  return group ? text_attribute(group.get(), "Type").value_or("") : "";
}

bool is_vtkhdf_array(const std::string& name) {
  return absolute(name).starts_with(point_data) || absolute(name).starts_with(cell_data);
}

std::optional<Geometry> geometry_of_image_data(hid_t file, const std::string& name, const Index3& dims) {
  if (!is_vtkhdf_array(name) || vtkhdf_type(file) != "ImageData") return std::nullopt;
  const bool at_cells = absolute(name).starts_with(cell_data);
  const Hdf5Handle group = opened_root(file);
  const auto numbers = [&](const char* attribute, std::size_t count) {
    std::vector<double> found = number_attribute(group.get(), attribute);
    const bool is_good = found.size() == count &&
                         std::ranges::all_of(found, [](double number) { return std::isfinite(number); });
    return is_good ? found : std::vector<double>();
  };
  const auto extent = numbers("WholeExtent", 6), origin = numbers("Origin", 3),
             spacing = numbers("Spacing", 3);
  auto direction = numbers("Direction", 9);
  if (extent.empty() || origin.empty() || spacing.empty()) return std::nullopt;
  if (direction.empty()) direction = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  Geometry geometry;
  std::ranges::copy(origin, geometry.origin.begin());
  std::ranges::copy(spacing, geometry.spacing.begin());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double points = extent[2 * axis + 1] - extent[2 * axis] + 1;
    if (points - (at_cells ? 1 : 0) != static_cast<double>(dims[static_cast<int>(axis)])) return std::nullopt;
    for (std::size_t row = 0; row < 3; ++row) {
      geometry.directions[axis][row] = direction[3 * row + axis] * spacing[axis];
      // Cells lie in the middle between points.
      geometry.origin[row] += (extent[2 * axis] + (at_cells ? 0.5 : 0)) * geometry.directions[axis][row];
    }
  }
  const double volume = determinant(geometry.directions);
  if (!std::isfinite(volume) || volume == 0) return std::nullopt;
  geometry.has_directions = direction != std::vector<double>{1, 0, 0, 0, 1, 0, 0, 0, 1};
  geometry.has_spacing = geometry.has_origin = true;
  return geometry;
}

}  // namespace tagrid
