#include "io/formats/hdf5/reader/geometry.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "io/formats/axes/axes.h"
#include "io/formats/axes/geometry_words.h"
#include "io/formats/hdf5/attributes.h"
#include "io/formats/hdf5/description.h"
#include "io/formats/hdf5/handle.h"
#include "io/formats/hdf5/reader/axis.h"
#include "io/formats/hdf5/reader/conventions.h"
#include "io/formats/hdf5/reader/datasets.h"
#include "io/formats/hdf5/reader/fields.h"
#include "io/formats/hdf5/reader/links.h"
#include "io/formats/hdf5/reader/meaning.h"
#include "io/formats/hdf5/reader/nexus.h"
#include "io/metadata/loss.h"
#include "io/metadata/rescale.h"
#include "io/text/text.h"
#include "io/volume/vtk.h"

namespace tagrid {
namespace {

bool is_nonzero(double number) { return std::isfinite(number) && number != 0; }

/// NaN is a spacing that is not known.
bool are_spacings(const std::vector<double>& numbers) {
  return std::ranges::all_of(numbers,
                             [](double number) { return std::isnan(number) || is_nonzero(number); }) &&
         std::ranges::any_of(numbers, is_nonzero);
}
std::array<std::array<double, 3>, 3> three_vectors(const std::vector<double>& numbers) {
  std::array<std::array<double, 3>, 3> vectors = {};
  for (std::size_t i = 0; i < 9; ++i) vectors[i / 3][i % 3] = numbers[i];
  return vectors;
}
bool are_directions(const std::vector<double>& numbers) {
  return is_nonzero(determinant(three_vectors(numbers)));
}

/// "mm", or one for each axis: "mm, mm, um".
std::array<std::string, 3> units_of(const std::string& text) {
  std::array<std::string, 3> units;
  if (std::ranges::count(text, ',') != 2) {
    units.fill(text);
    return units;
  }
  std::size_t axis = 0;
  for (const char c : text)
    if (c == ',')
      ++axis;
    else if (c != ' ' && c != '?')
      units[axis] += c;
  return units;
}

/// A volume has one unit for all axes.
void convert_units(const std::string& path, Geometry& geometry, std::vector<std::string>& warnings) {
  std::array<bool, 3> used = {};
  for (std::size_t axis = 0; axis < 3; ++axis)
    used[axis] = geometry.has_directions || !std::isnan(geometry.spacing[axis]);
  const UnitOfAxes common = common_unit(geometry.units, used);
  if (!common.remark.empty()) warnings.push_back(fmt::format("{}: {}", path, common.remark));
  // Units of directions are those of the axes of space.
  for (std::size_t axis = 0; axis < 3; ++axis) {
    geometry.spacing[axis] = common.convert(axis, geometry.spacing[axis]);
    geometry.origin[axis] = common.convert(axis, geometry.origin[axis]);
    for (auto& direction : geometry.directions) direction[axis] = common.convert(axis, direction[axis]);
  }
  geometry.units = common.units;
}

/// True if the nine numbers are three unit vectors at right angles.
bool is_rotation(const std::vector<double>& numbers) {
  constexpr double rounding = 1e-4;
  const auto vectors = three_vectors(numbers);
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      double product = 0;
      for (std::size_t row = 0; row < 3; ++row) product += vectors[i][row] * vectors[j][row];
      if (!(std::abs(product - (i == j ? 1 : 0)) < rounding)) return false;
    }
  return true;
}

bool is_symmetric(const std::vector<double>& matrix) {
  return matrix[1] == matrix[3] && matrix[2] == matrix[6] && matrix[5] == matrix[7];
}

/// Applies a matrix as image libraries store it, row by row; its columns are the directions of
/// axes. tagrid's own attribute `directions` is different: it has the vectors of the axes, which
/// are as long as the spacing.
void apply_matrix(const char* name, const std::vector<double>& matrix, Fields& fields, Geometry& geometry) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t row = 0; row < 3; ++row)
      geometry.directions[axis][row] = matrix[3 * row + axis] * spacing_or_1(geometry, axis);
  geometry.has_directions = true;
  if (!geometry.has_spacing)
    fields.warnings.push_back(fmt::format(
        "{}: {} rotates the axes, but there is no spacing that is read; 1 is assumed", fields.name(), name));
}

/// What the attributes of the data set say.
Geometry geometry_of_attributes(Fields& fields) {
  constexpr const char* no_spacing = "the spacing is not taken from it";
  Geometry geometry;
  bool is_order_stated =
      fields.has(hdf5_header_attribute) || fields.has("spacing_units") || fields.has("space");
  const auto spacing = fields.numbers("spacing", 3, no_spacing, are_spacings);
  const auto size = fields.numbers("element_size_um", 3, no_spacing, are_steps);
  const std::string unit = fields.text("spacing_units", "the unit is unknown");
  if (spacing.is_number()) {
    std::ranges::copy(spacing.values, geometry.spacing.begin());
    geometry.units = units_of(unit);
    geometry.has_spacing = true;
  } else if (size.is_number()) {
    geometry.spacing = {size.values[2], size.values[1], size.values[0]};
    geometry.has_spacing = true;
    geometry.units.fill("um");
  }
  const auto matrix = fields.numbers("direction", 9, "the directions are unknown", are_directions);
  const auto d = fields.numbers("directions", 9, "the directions are unknown", are_directions);
  const bool has_units_of_length = std::ranges::all_of(spacing.values, [](double one) { return one == 1; });
  if (matrix.is_number()) {
    apply_matrix("direction", matrix.values, fields, geometry);
    is_order_stated = true;
  } else if (d.is_number() && !is_order_stated && !has_units_of_length && is_rotation(d.values)) {
    apply_matrix("directions", d.values, fields, geometry);
    is_order_stated = true;
    fields.warnings.push_back(fmt::format(
        "{}: directions is read as the rows of a matrix whose columns are the directions of x, y and z",
        fields.name()));
  } else if (d.is_number()) {
    if (!is_order_stated && is_rotation(d.values) && !is_symmetric(d.values))
      fields.warnings.push_back(
          fmt::format("{}: directions is read as the directions of x, y and z, one after the other; if it "
                      "holds the rows of a matrix whose columns are these directions, the axes are rotated "
                      "the wrong way",
                      fields.name()));
    is_order_stated = true;
    geometry.directions = three_vectors(d.values);
    geometry.has_directions = true;
    geometry.units = units_of(unit);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto& [x, y, z] = geometry.directions[axis];
      const double length = std::hypot(x, y, z), given = std::abs(geometry.spacing[axis]);
      constexpr double rounding = 1e-6;
      if (spacing.is_number() && std::abs(given - length) > rounding * length)
        fields.warnings.push_back(
            fmt::format("{}: the spacing along {} is {}, but its direction is {} long; the direction counts",
                        fields.name(), "xyz"[axis], given, length));
    }
  }
  if (const auto origin = fields.numbers("origin", 3, "the origin is unknown"); origin.is_number()) {
    std::ranges::copy(origin.values, geometry.origin.begin());
    geometry.has_origin = true;
  }
  const auto depends_on_order = [](const AttributeNumbers& found) {
    return found.is_number() && found.values[0] != found.values[2];
  };
  if (!is_order_stated && depends_on_order(spacing))
    fields.warnings.push_back(about_assumed_order(fields.name(), "spacing"));
  if (!is_order_stated && geometry.has_origin && geometry.origin[0] != geometry.origin[2])
    fields.warnings.push_back(about_assumed_order(fields.name(), "origin"));
  geometry.space = fields.text("space", "the coordinate system is unknown");
  return geometry;
}

/// The attributes that are not among `known`, as pairs. Those by which tagrid says that samples have a loss, or
/// are in doubt, keep their names.
KeyValues other_attributes(hid_t dataset, const std::vector<std::string>& known) {
  KeyValues pairs;
  for (auto& [key, value] : all_attributes(dataset))
    if (key != hdf5_header_attribute && std::ranges::find(known, key) == known.end()) {
      const bool is_ours = key == lossy_source_key || key == scale_doubt_key || key == not_understood_key;
      pairs.emplace_back(is_ours ? key : "hdf5_" + key, std::move(value));
    }
  return pairs;
}

/// Attributes that geometry_of_attributes() and other_meanings() read, or warn about.
constexpr const char* attributes_read[] = {"spacing",    "spacing_units",   "element_size_um",
                                           "direction",  "directions",      "origin",
                                           "axis_order", "dimension_order", "axistags"};

constexpr const char* vtk_group = "/VTKHDF";
constexpr std::string_view point_data = "/VTKHDF/PointData/", cell_data = "/VTKHDF/CellData/";

Hdf5Handle opened_root(hid_t file) {
  return has_link(file, vtk_group) ? object_at(file, vtk_group) : Hdf5Handle();
}

/// Paths may be given without the first slash.
std::string absolute(const std::string& name) { return name.starts_with('/') ? name : "/" + name; }

/// The geometry of the array at this path, if it is a volume of these dimensions in image data. Attributes
/// that cannot be read give none, and warnings. `path` is that of the file.
std::optional<Geometry> geometry_of_image_data(hid_t file, const std::string& path, const std::string& name,
                                               const Index3& dims, std::vector<std::string>& warnings) {
  if (!is_vtkhdf_array(name) || vtkhdf_type(file) != "ImageData") return std::nullopt;
  const bool at_cells = absolute(name).starts_with(cell_data);
  const Hdf5Handle group = opened_root(file);
  constexpr const char* unknown = "the positions of samples are unknown";
  const std::string where = fmt::format("{}: VTKHDF file", path);
  Fields fields(group.get(), where);
  const auto extent = fields.numbers("WholeExtent", 6, unknown),
             origin = fields.numbers("Origin", 3, unknown),
             spacing = fields.numbers("Spacing", 3, unknown, are_steps),
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

/// False if the image of VTKHDF around the array lies elsewhere than these header lines put the array, as
/// somebody changed it since.
bool image_agrees(hid_t file, const std::string& name, const Metadata& header) {
  const Hdf5Handle group = is_vtkhdf_array(name) ? opened_root(file) : Hdf5Handle();
  if (!group) return true;
  const VtkGeometry written = vtk_geometry_of(header.geometry());
  const auto says = [&](const char* attribute, const auto& numbers) {
    return std::ranges::equal(number_attribute(group.get(), attribute), numbers);
  };
  return says("Origin", written.origin) && says("Spacing", written.spacing) &&
         says("Direction", written.direction);
}

}  // namespace

void describe_dataset(hid_t file, const std::string& path, const std::string& name, ServedVolume& volume) {
  const Hdf5Handle dataset = opened_dataset(file, name);
  const std::vector<std::string> of_scale = set_scale(file, path, name, volume);
  const auto warn = [&](const std::vector<std::string>& warnings) {
    volume.warnings.insert(volume.warnings.end(), warnings.begin(), warnings.end());
  };
  std::vector<std::string> known;
  auto header = header_of(dataset.get(), known);
  const bool is_moved = header && !image_agrees(file, name, *header);
  if (header && !is_moved) {
    known.insert(known.end(), of_scale.begin(), of_scale.end());
    KeyValues pairs = other_attributes(dataset.get(), known);
    if (header->text_of("rescale_slope").empty()) add_rescale(volume.rescale, pairs);
    header->add_pairs(pairs);
    volume.metadata = std::move(header);
    return;
  }
  Fields fields(dataset.get(), fmt::format("{}: HDF5 file: {}", path, name));
  Geometry geometry = is_moved ? Geometry() : geometry_of_attributes(fields);
  if (is_moved)
    volume.warnings.push_back(fmt::format(
        "{}: VTKHDF file: Origin, Spacing and Direction are not those that tagrid wrote; they count, "
        "and the unit and the coordinate system that it recorded are left out",
        path));
  KeyValues pairs = {{"hdf5_dataset", name}};
  Convention convention;
  bool are_axes_read = false;
  if (!geometry.has_spacing && !geometry.has_directions) {
    if (auto image = geometry_of_image_data(file, path, name, volume.dims, volume.warnings)) {
      geometry = *image;
    } else if (auto other = convention_of(file, path, inside("/", name), volume.dims)) {
      convention = std::move(*other);
      geometry = convention.geometry;
      warn(convention.warnings);
    } else if (auto places = nexus_places(file, path, name, dims_of(dataset.get()))) {
      geometry = places->geometry;
      are_axes_read = true;
      convention.are_axes_placed = places->are_axes_placed;
      pairs.insert(pairs.end(), places->pairs.begin(), places->pairs.end());
      warn(places->warnings);
    }
  }
  if (convention.slope != 1 && volume.rescale == Rescale{} && volume.scale_doubt.empty())
    volume.rescale.slope = convention.slope;
  if (!are_axes_read) convert_units(path, geometry, fields.warnings);
  warn(fields.warnings);
  for (std::string& sentence : nexus_companions(file, path, name))
    volume.not_understood.push_back(std::move(sentence));
  for (std::string& sentence :
       other_meanings(file, name, fields.name(), volume.dims, convention.are_axes_placed))
    volume.not_understood.push_back(std::move(sentence));
  std::vector<std::string> read = std::move(convention.known);
  read.insert(read.end(), std::begin(attributes_read), std::end(attributes_read));
  if (are_axes_read || has_names_of_axes(file, name)) read.emplace_back("axes");
  if (is_vtkhdf_array(name)) read.insert(read.end(), {"Origin", "Spacing", "Direction"});
  if (is_nexus_signal(file, name)) read.emplace_back("offset");
  if (const auto names = unread_geometry(file, inside("/", name), read); !names.empty())
    volume.not_understood.push_back(about_unread_geometry(fields.name(), names));
  for (auto& pair : other_attributes(dataset.get(), of_scale)) pairs.push_back(std::move(pair));
  add_rescale(volume.rescale, pairs);
  volume.metadata = metadata_of_places(geometry, pairs);
}

std::string vtkhdf_type(hid_t file) {
  const Hdf5Handle group = opened_root(file);
  return group ? text_attribute(group.get(), "Type").value_or("") : "";
}

bool is_vtkhdf_array(const std::string& name) {
  return absolute(name).starts_with(point_data) || absolute(name).starts_with(cell_data);
}

namespace {

/// Attributes of a group say little about data sets far below it.
constexpr int most_groups = 8;
constexpr hssize_t most_numbers = 16;
constexpr std::size_t most_beside = 1000;

std::vector<std::string> names_of_links(hid_t group) {
  std::vector<std::string> names;
  const auto add = [](hid_t, const char* name, const H5L_info_t* info, void* user) -> herr_t {
    auto& all = *static_cast<std::vector<std::string>*>(user);
    if (info->type == H5L_TYPE_HARD) all.emplace_back(name);
    return all.size() < most_beside ? 0 : 1;
  };
  H5Literate(group, H5_INDEX_NAME, H5_ITER_INC, nullptr, add, &names);
  return names;
}

bool is_short_list(hid_t group, const std::string& name) {
  const Hdf5Handle object = object_at(group, name);
  if (H5Iget_type(object.get()) != H5I_DATASET) return false;
  const Hdf5Handle space = space_of(object.get());
  const hssize_t count = space ? H5Sget_simple_extent_npoints(space.get()) : 0;
  return count > 0 && count <= most_numbers;
}

}  // namespace

std::vector<std::string> unread_geometry(hid_t file, const std::string& name,
                                         const std::vector<std::string>& known) {
  std::vector<std::string> found;
  const auto is_unread = [&](const std::string& one) {
    return looks_like_geometry(one) && std::ranges::find(known, one) == known.end();
  };
  const auto look = [&](hid_t object, const std::string& where) {
    for (const std::string& one : attribute_names(object))
      if (is_unread(one) && !attribute_in_words(object, one).empty())
        found.push_back(where.empty() ? one : fmt::format("{} (of {})", one, where));
  };
  const Hdf5Handle dataset = object_at(file, name);
  look(dataset.get(), "");
  std::string path = name;
  for (int i = 0; i < most_groups && path != "/"; ++i) {
    const auto [group_path, own] = group_and_name(path);
    const Hdf5Handle group = object_at(file, group_path);
    look(group.get(), group_path);
    if (i == 0)
      for (const std::string& one : names_of_links(group.get()))
        if (one != own && is_unread(one) && is_short_list(group.get(), one))
          found.push_back(inside(group_path, one));
    path = group_path;
  }
  return found;
}

}  // namespace tagrid
