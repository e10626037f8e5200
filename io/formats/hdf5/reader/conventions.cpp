#include "io/formats/hdf5/reader/conventions.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "io/formats/hdf5/attributes.h"
#include "io/formats/hdf5/handle.h"
#include "io/formats/hdf5/reader/datasets.h"
#include "io/formats/hdf5/reader/fields.h"
#include "io/formats/hdf5/reader/links.h"
#include "io/text/foreign_number.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

constexpr const char* info_of_imaris = "/DataSetInfo/Image";

/// `count` numbers that are a data set of their own; none if there are not as many, or one of them is not finite.
std::vector<double> numbers_at(hid_t file, const std::string& path, const std::string& name,
                               std::size_t count) {
  const Hdf5Handle dataset = opened_dataset(file, name);
  const Hdf5Handle space = dataset ? space_of(dataset.get()) : Hdf5Handle();
  std::vector<double> numbers(count);
  if (!space || H5Sget_simple_extent_npoints(space.get()) != static_cast<hssize_t>(count) ||
      !has_own_samples(path, dataset.get()) ||
      H5Dread(dataset.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data()) < 0 ||
      !are_finite(numbers))
    return {};
  return numbers;
}

/// Imaris writes a text as a list of letters.
std::string text_of_letters(hid_t object, const std::string& name) {
  std::string text;
  for (const std::string& letter : text_list_attribute(object, name)) text += letter;
  return text;
}

/// "/ITKImage/0/VoxelData": fields of the group, x first; Directions has the vector of an axis in each row.
std::optional<Convention> itk_of(hid_t file, const std::string& path, const std::string& name) {
  const auto [group, own] = group_and_name(name);
  if (!name.starts_with("/ITKImage/") || own != "VoxelData") return std::nullopt;
  Convention found;
  found.known = {"Origin", "Spacing", "Directions", "Dimension", "VoxelType"};
  const auto spacing = numbers_at(file, path, group + "/Spacing", 3),
             origin = numbers_at(file, path, group + "/Origin", 3),
             directions = numbers_at(file, path, group + "/Directions", 9);
  if (spacing.empty() || origin.empty() || directions.empty() || !are_steps(spacing)) {
    found.warnings.push_back(fmt::format(
        "{}: HDF5 file (ITK): Origin, Spacing and Directions of {} are not those of a volume; the positions "
        "of samples are unknown",
        path, group));
    return found;
  }
  SpaceOfLetters space;
  space.origin.emplace();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    (*space.origin)[axis] = origin[axis];
    for (std::size_t row = 0; row < 3; ++row)
      space.steps[axis][row] = directions[3 * axis + row] * spacing[axis];
  }
  if (const auto geometry = geometry_of_letters({"z", "y", "x"}, space)) found.geometry = *geometry;
  found.geometry.space = "left-posterior-superior";
  found.geometry.units.fill("mm");  // of all lengths of ITK
  return found;
}

/// The image of Imaris ends at its borders, not at its samples.
std::optional<Convention> imaris_of(hid_t file, const std::string& path, const std::string& name,
                                    const Index3& dims) {
  if (!is_imaris(file) || !name.starts_with("/DataSet/ResolutionLevel ")) return std::nullopt;
  const Hdf5Handle image = object_at(file, info_of_imaris);
  Convention found;
  const Hdf5Handle channel = object_at(file, group_and_name(name).first);
  const bool is_size_said =
      number_of_letters(channel.get(), "ImageSizeX").is_number() ||
      (name.starts_with(finest_of_imaris) && number_of_letters(image.get(), "X").is_number());
  if (!is_size_said)
    found.warnings.push_back(fmt::format(
        "{}: HDF5 file (Imaris): {} does not state its size (ImageSizeX, ImageSizeY, ImageSizeZ); if it is "
        "padded to whole chunks, the padding is read as well, and the spacing is too small",
        path, name));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const ForeignNumber low = number_of_letters(image.get(), fmt::format("ExtMin{}", axis)),
                        high = number_of_letters(image.get(), fmt::format("ExtMax{}", axis));
    if (!low.is_number() || !high.is_number() || low.value == high.value) {
      found.warnings.push_back(fmt::format(
          "{}: HDF5 file (Imaris): ExtMin{} and ExtMax{} are not two borders; the positions of samples are "
          "unknown",
          path, axis, axis));
      found.geometry = {};
      return found;
    }
    const double step = (high.value - low.value) / static_cast<double>(dims[static_cast<int>(axis)]);
    found.geometry.spacing[axis] = std::abs(step);
    found.geometry.directions[axis][axis] = step;
    found.geometry.has_directions |= step < 0;
    found.geometry.origin[axis] = low.value + step / 2;
  }
  found.geometry.units.fill(text_of_letters(image.get(), "Unit"));
  found.geometry.has_spacing = found.geometry.has_origin = true;
  return found;
}

/// Attributes of the group of a map: `step` and `origin`, x first, in angstrom.
std::optional<Convention> chimera_of(hid_t file, const std::string& path, const std::string& name) {
  const Hdf5Handle group = object_at(file, group_and_name(name).first);
  if (!name.starts_with("/Chimera/") || !group) return std::nullopt;
  Convention found;
  found.known = {"step", "origin"};
  Fields fields(group.get(), fmt::format("{}: HDF5 file (Chimera): {}", path, name));
  const auto step = fields.numbers("step", 3, "the spacing is unknown", are_steps);
  const auto origin = fields.numbers("origin", 3, "the origin is unknown");
  if (step.is_number()) {
    std::ranges::copy(step.values, found.geometry.spacing.begin());
    found.geometry.has_spacing = true;
    found.geometry.units.fill("angstrom");
  }
  if (origin.is_number()) {
    std::ranges::copy(origin.values, found.geometry.origin.begin());
    found.geometry.has_origin = true;
  }
  const auto angles = number_attribute(group.get(), "cell_angles");
  if (std::ranges::any_of(angles, [](double angle) { return angle != 90; }) ||
      number_attribute(group.get(), "rotation_angle").size() +
              number_attribute(group.get(), "rotation_axis").size() >
          0)
    fields.warnings.push_back(
        fmt::format("{}: cell_angles or rotation_angle of its group rotate its axes, which is not applied",
                    fields.name()));
  found.warnings = fields.warnings;
  return found;
}

/// "/MDF/images/0/image": attributes of its group, in angstrom.
std::optional<Convention> eman_of(hid_t file, const std::string& path, const std::string& name) {
  const Hdf5Handle group = object_at(file, group_and_name(name).first);
  if (!name.starts_with("/MDF/images/") || !group) return std::nullopt;
  Convention found;
  Fields fields(group.get(), fmt::format("{}: HDF5 file (EMAN): {}", path, name));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string attribute = fmt::format("EMAN.apix_{}", "xyz"[axis]);
    const auto step = fields.numbers(attribute, 1, "the spacing is unknown", are_steps);
    found.known.push_back(attribute);
    if (!step.is_number()) continue;
    found.geometry.spacing[axis] = step.values[0];
    found.geometry.has_spacing = true;
  }
  found.geometry.units.fill(found.geometry.has_spacing ? "angstrom" : "");
  found.warnings = fields.warnings;
  return found;
}

/// "/volumes/raw": `resolution` and `offset` of CREMI, z first, in nanometers.
std::optional<Convention> cremi_of(hid_t file, const std::string& path, const std::string& name) {
  const Hdf5Handle dataset = opened_dataset(file, name);
  if (!name.starts_with("/volumes/") || !dataset || H5Aexists(dataset.get(), "resolution") <= 0)
    return std::nullopt;
  Convention found;
  found.known = {"resolution", "offset"};
  Fields fields(dataset.get(), fmt::format("{}: HDF5 file (CREMI): {}", path, name));
  const auto size = fields.numbers("resolution", 3, "the spacing is unknown", are_steps);
  const auto offset = fields.numbers("offset", 3, "the origin is unknown");
  found.warnings = fields.warnings;
  if (!size.is_number()) return found;
  std::ranges::reverse_copy(size.values, found.geometry.spacing.begin());
  if (offset.is_number()) std::ranges::reverse_copy(offset.values, found.geometry.origin.begin());
  found.geometry.has_spacing = true;
  found.geometry.has_origin = !offset.is_unreadable();
  found.geometry.units.fill("nm");
  return found;
}

}  // namespace

ForeignNumber number_of_letters(hid_t object, const std::string& name) {
  const std::string text = text_of_letters(object, name);
  return text.empty() ? ForeignNumber() : foreign_number(std::optional<std::string_view>(text));
}

std::optional<Convention> convention_of(hid_t file, const std::string& path, const std::string& name,
                                        const Index3& dims) {
  if (auto found = itk_of(file, path, name)) return found;
  if (auto found = openpmd_of(file, path, name)) return found;
  if (auto found = minc_of(file, path, name)) return found;
  if (auto found = imaris_of(file, path, name, dims)) return found;
  if (auto found = chimera_of(file, path, name)) return found;
  if (auto found = eman_of(file, path, name)) return found;
  return cremi_of(file, path, name);
}

bool is_imaris(hid_t file) {
  return has_link(file, "/DataSetInfo") && has_object(file, info_of_imaris) && has_link(file, "/DataSet") &&
         has_link(file, "/DataSet/ResolutionLevel 0");
}

std::optional<Index3> imaris_size(hid_t file, const std::string& name, const Index3& dims) {
  const std::string path = inside("/", name);
  if (!is_imaris(file) || !path.starts_with("/DataSet/ResolutionLevel ")) return std::nullopt;
  const Hdf5Handle channel = object_at(file, group_and_name(path).first),
                   image = object_at(file, info_of_imaris);
  Index3 size = dims;
  for (int axis = 0; axis < 3; ++axis) {
    const char letter = "XYZ"[axis];
    ForeignNumber samples = number_of_letters(channel.get(), fmt::format("ImageSize{}", letter));
    // The size of the whole image is that of its finest level.
    if (!samples.is_number() && path.starts_with(finest_of_imaris))
      samples = number_of_letters(image.get(), std::string(1, letter));
    if (!samples.is_number() || samples.value < 1 || samples.value > static_cast<double>(dims[axis]) ||
        samples.value != std::floor(samples.value))
      return std::nullopt;
    size[axis] = static_cast<std::int64_t>(samples.value);
  }
  return size == dims ? std::nullopt : std::optional(size);
}

namespace {

bool is_step(double number) { return std::isfinite(number) && number != 0; }

/// The unit of so many meters, and by how much lengths are multiplied then.
std::pair<std::string, double> unit_of_meters(double meters) {
  for (const auto& [unit, size] :
       {std::pair("m", 1.0), {"cm", 1e-2}, {"mm", 1e-3}, {"um", 1e-6}, {"nm", 1e-9}})
    if (std::abs(meters - size) <= 1e-12 * size) return {unit, 1};
  return {"m", meters};
}

std::optional<std::size_t> number_of_letter(const std::string& label) {
  const std::string letter = lower_case(label);
  if (letter != "x" && letter != "y" && letter != "z") return std::nullopt;
  return static_cast<std::size_t>(letter[0] - 'x');
}

void say_order(const std::string& object, const std::vector<std::string>& letters, Convention& found) {
  if (!found.geometry.has_directions || letters == std::vector<std::string>{"z", "y", "x"}) return;
  found.are_axes_placed = true;
  found.warnings.push_back(fmt::format(
      "{}: its axes are {}, the slowest one first; samples stay in this order, and the directions describe "
      "the axes",
      object, fmt::join(letters, ", ")));
}

}  // namespace

std::optional<Geometry> geometry_of_letters(const std::vector<std::string>& letters,
                                            const SpaceOfLetters& space) {
  if (letters.size() != 3) return std::nullopt;
  Geometry geometry;
  std::array<bool, 3> is_met = {};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto letter = number_of_letter(letters[2 - axis]);
    if (!letter || std::exchange(is_met[*letter], true)) return std::nullopt;
    const auto& step = space.steps[*letter];
    geometry.directions[axis] = step;
    geometry.spacing[axis] = std::hypot(step[0], step[1], step[2]);
    if (!is_step(geometry.spacing[axis])) return std::nullopt;
    for (std::size_t row = 0; row < 3; ++row)
      if (row == axis ? step[row] < 0 : step[row] != 0) geometry.has_directions = true;
  }
  geometry.units = space.units;
  geometry.has_spacing = true;
  geometry.has_origin = space.origin.has_value();
  if (space.origin) geometry.origin = *space.origin;
  return geometry;
}

std::optional<Convention> openpmd_of(hid_t file, const std::string& path, const std::string& name) {
  const Hdf5Handle root = object_at(file, "/"), dataset = opened_dataset(file, name);
  if (!dataset || H5Aexists(root.get(), "openPMD") <= 0) return std::nullopt;
  // A component of a vector is in a group, which has the grid; a scalar is a data set with all of it.
  const Hdf5Handle group = object_at(file, group_and_name(name).first);
  const bool is_scalar = H5Aexists(dataset.get(), "gridSpacing") > 0;
  const hid_t mesh = is_scalar ? dataset.get() : group.get();
  if (H5Aexists(mesh, "gridSpacing") <= 0) return std::nullopt;
  Convention found;
  found.known = {"axisLabels", "gridSpacing",       "gridGlobalOffset",
                 "gridUnitSI", "gridUnitDimension", "unitSI"};
  const std::string object = fmt::format("{}: HDF5 file (openPMD): {}", path, name);
  Fields of_mesh(mesh, object), of_values(dataset.get(), object);
  const auto give_up = [&](const std::string& why) {
    found.warnings = of_mesh.warnings;
    found.warnings.push_back(fmt::format("{}: {}; the positions of samples are unknown", object, why));
    return found;
  };
  if (const auto slope = of_values.numbers("unitSI", 1, "the values in SI units are unknown", are_steps);
      slope.is_number())
    found.slope = slope.values[0];
  std::vector<std::string> labels = text_list_attribute(mesh, "axisLabels");
  if (labels.size() != 3) return give_up(fmt::format("it has {} axisLabels, not three", labels.size()));
  const auto steps = of_mesh.numbers("gridSpacing", 3, "the spacing is unknown", are_steps);
  const auto offsets = of_mesh.numbers("gridGlobalOffset", 3, "the origin is unknown");
  const auto inside_cell = of_values.numbers("position", 3, "positions in cells are unknown");
  auto meters = of_mesh.numbers("gridUnitSI", 1, "the unit is unknown", are_steps);
  if (const std::string kind = text_attribute(mesh, "geometry").value_or("cartesian"); kind != "cartesian")
    return give_up(fmt::format("geometry is {}, not cartesian", tagrid::quoted(kind)));
  if (!steps.is_number()) return give_up("gridSpacing cannot be read");
  SpaceOfLetters space;
  const auto [unit, factor] =
      meters.is_number() ? unit_of_meters(meters.values[0]) : std::pair<std::string, double>("", 1);
  space.units.fill(unit);
  if (offsets.is_number()) space.origin.emplace();
  for (std::size_t i = 0; i < 3; ++i) {
    const auto letter = number_of_letter(labels[i]);
    if (!letter) return give_up(fmt::format("its axes are called {}", fmt::join(labels, ", ")));
    space.steps[*letter][*letter] = steps.values[i] * factor;
    const double part = inside_cell.is_number() ? inside_cell.values[i] * steps.values[i] : 0;
    if (space.origin) (*space.origin)[*letter] = (offsets.values[i] + part) * factor;
  }
  // In the order of Fortran, lists begin with the fastest axis.
  if (text_attribute(mesh, "dataOrder") == "F") std::ranges::reverse(labels);
  const auto geometry = geometry_of_letters(labels, space);
  if (!geometry) return give_up(fmt::format("its axes are called {}", fmt::join(labels, ", ")));
  found.geometry = *geometry;
  found.warnings = of_mesh.warnings;
  found.warnings.insert(found.warnings.end(), of_values.warnings.begin(), of_values.warnings.end());
  say_order(object, labels, found);
  return found;
}

std::optional<Convention> minc_of(hid_t file, const std::string& path, const std::string& name) {
  constexpr const char* dimensions = "/minc-2.0/dimensions";
  const Hdf5Handle dataset = opened_dataset(file, name);
  if (!dataset || !name.starts_with("/minc-2.0/image/") || !has_object(file, dimensions)) return std::nullopt;
  Convention found;
  const std::string object = fmt::format("{}: HDF5 file (MINC): {}", path, name);
  std::vector<std::string> letters;
  const std::string order = text_attribute(dataset.get(), "dimorder").value_or("");
  for (const std::string_view word : split(order, ','))
    letters.emplace_back(word.substr(0, word.find("space")));
  SpaceOfLetters space;
  space.origin.emplace();
  for (std::size_t letter = 0; letter < 3; ++letter) {
    const std::string axis = fmt::format("{}/{}space", dimensions, "xyz"[letter]);
    const Hdf5Handle of_axis = object_at(file, axis);
    if (!of_axis) continue;
    Fields fields(of_axis.get(), fmt::format("{}: HDF5 file (MINC): {}", path, axis));
    const auto step = fields.numbers("step", 1, "the spacing is unknown", are_steps);
    const auto start = fields.numbers("start", 1, "the origin is unknown");
    const auto cosines = fields.numbers("direction_cosines", 3, "the direction is unknown");
    found.warnings.insert(found.warnings.end(), fields.warnings.begin(), fields.warnings.end());
    std::array<double, 3> direction = {};
    direction[letter] = 1;
    if (cosines.is_number()) std::ranges::copy(cosines.values, direction.begin());
    if (!start.is_number()) space.origin.reset();
    for (std::size_t row = 0; row < 3; ++row) {
      space.steps[letter][row] = step.is_number() ? step.values[0] * direction[row] : 0;
      if (space.origin && start.is_number()) (*space.origin)[row] += start.values[0] * direction[row];
    }
    space.units[letter] = text_attribute(of_axis.get(), "units").value_or("");
    if (text_attribute(of_axis.get(), "spacing").value_or("").starts_with("irregular"))
      found.warnings.push_back(
          fmt::format("{}: samples along {} lie at unequal distances; step is used for all of them", object,
                      "xyz"[letter]));
  }
  const auto geometry = geometry_of_letters(letters, space);
  if (!geometry) {
    found.warnings.push_back(
        fmt::format("{}: dimorder is {}, and {} does not describe such axes; the positions of samples are "
                    "unknown",
                    object, tagrid::quoted(order), dimensions));
    return found;
  }
  found.geometry = *geometry;
  found.geometry.space = "right-anterior-superior";
  say_order(object, letters, found);
  return found;
}

}  // namespace tagrid
