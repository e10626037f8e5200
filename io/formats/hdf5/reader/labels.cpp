#include "io/formats/hdf5/reader/labels.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "io/formats/hdf5/attributes.h"
#include "io/formats/hdf5/handle.h"
#include "io/formats/hdf5/reader/datasets.h"
#include "io/formats/hdf5/reader/fields.h"
#include "io/formats/hdf5/reader/links.h"
#include "io/text/text.h"

namespace tagrid {
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
  const Hdf5Handle root(H5Oopen(file, "/", H5P_DEFAULT), H5Oclose), dataset = opened_dataset(file, name);
  if (!dataset || H5Aexists(root.get(), "openPMD") <= 0) return std::nullopt;
  // A component of a vector is in a group, which has the grid; a scalar is a data set with all of it.
  const Hdf5Handle group(H5Oopen(file, group_and_name(name).first.c_str(), H5P_DEFAULT), H5Oclose);
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
  if (!dataset || !name.starts_with("/minc-2.0/image/") ||
      H5Oexists_by_name(file, dimensions, H5P_DEFAULT) <= 0)
    return std::nullopt;
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
    const Hdf5Handle of_axis(H5Oopen(file, axis.c_str(), H5P_DEFAULT), H5Oclose);
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
