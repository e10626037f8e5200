#include "io/formats/hdf5/reader/conventions.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "io/formats/hdf5/attributes.h"
#include "io/formats/hdf5/handle.h"
#include "io/formats/hdf5/reader/datasets.h"
#include "io/formats/hdf5/reader/fields.h"
#include "io/formats/hdf5/reader/labels.h"
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
  const Hdf5Handle space(dataset ? H5Dget_space(dataset.get()) : -1, H5Sclose);
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
  const Hdf5Handle image(H5Oopen(file, info_of_imaris, H5P_DEFAULT), H5Oclose);
  Convention found;
  const Hdf5Handle channel(H5Oopen(file, group_and_name(name).first.c_str(), H5P_DEFAULT), H5Oclose);
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
  const Hdf5Handle group(H5Oopen(file, group_and_name(name).first.c_str(), H5P_DEFAULT), H5Oclose);
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
  const Hdf5Handle group(H5Oopen(file, group_and_name(name).first.c_str(), H5P_DEFAULT), H5Oclose);
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
  return H5Lexists(file, "/DataSetInfo", H5P_DEFAULT) > 0 &&
         H5Oexists_by_name(file, info_of_imaris, H5P_DEFAULT) > 0 &&
         H5Lexists(file, "/DataSet", H5P_DEFAULT) > 0 &&
         H5Lexists(file, "/DataSet/ResolutionLevel 0", H5P_DEFAULT) > 0;
}

std::optional<Index3> imaris_size(hid_t file, const std::string& name, const Index3& dims) {
  const std::string path = inside("/", name);
  if (!is_imaris(file) || !path.starts_with("/DataSet/ResolutionLevel ")) return std::nullopt;
  const Hdf5Handle channel(H5Oopen(file, group_and_name(path).first.c_str(), H5P_DEFAULT), H5Oclose),
      image(H5Oopen(file, info_of_imaris, H5P_DEFAULT), H5Oclose);
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

}  // namespace tagrid
