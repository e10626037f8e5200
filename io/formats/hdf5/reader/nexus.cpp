#include "io/formats/hdf5/reader/nexus.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "io/formats/hdf5/attributes.h"
#include "io/formats/hdf5/reader/axis.h"
#include "io/formats/hdf5/reader/conventions.h"
#include "io/formats/hdf5/reader/datasets.h"
#include "io/formats/hdf5/reader/links.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

/// "z:y:x" or "[z,y,x]", as older files have it in the data set, become three names.
std::vector<std::string> parts_of(const std::string& text) {
  std::vector<std::string> parts(1);
  for (const char c : text)
    if (c == ':' || c == ',')
      parts.emplace_back();
    else if (std::string_view("[]() '\"").find(c) == std::string_view::npos)
      parts.back() += c;
  return parts;
}

}  // namespace

std::string nexus_signal_of(hid_t group, const std::string& group_path) {
  const auto signal = text_attribute(group, "signal");
  if (!signal) return "";
  const std::string path = inside(group_path, *signal);
  // Other files may have an attribute of this name, too.
  const bool is_of_nexus = text_attribute(group, "NX_class").value_or("").starts_with("NX");
  return is_of_nexus || (!signal->empty() && has_link(group, signal->c_str())) ? path : "";
}

std::string nexus_default(hid_t file, const std::string& path) {
  std::string at = "/";
  for (int depth = 0; depth < 8; ++depth) {
    const Hdf5Handle object = object_at(file, at);
    if (H5Iget_type(object.get()) == H5I_DATASET) return at;
    const bool has_signal = text_attribute(object.get(), "signal").has_value();
    const char* const attribute = has_signal ? "signal" : "default";
    const auto next = text_attribute(object.get(), attribute);
    if (!next || (next->empty() && !has_signal)) return "";
    const std::string target = inside(at, *next);
    const std::string why = next->empty()                     ? "it is empty"
                            : why_missing(file, target) != "" ? why_missing(file, target)
                            : has_signal && !opened_dataset(file, target)
                                ? fmt::format("{} is no data set", target)
                                : "";
    if (!why.empty())
      throw broken_hdf5(path,
                        fmt::format("the attribute {} of {} names no data: {}; --dataset chooses a data set "
                                    "regardless of it",
                                    attribute, at, why));
    at = target;
  }
  return "";
}

bool is_nexus_signal(hid_t file, const std::string& path) {
  const auto [group_path, name] = group_and_name(path);
  const Hdf5Handle group = object_at(file, group_path);
  if (group && text_attribute(group.get(), "signal") == name) return true;
  // As older files have it.
  const Hdf5Handle dataset = opened_dataset(file, path);
  return dataset && (text_attribute(dataset.get(), "signal") == "1" ||
                     number_attribute(dataset.get(), "signal") == std::vector<double>{1});
}

std::vector<std::string> names_of_nexus_axes(hid_t group, hid_t dataset) {
  std::vector<std::string> names = text_list_attribute(group, "axes");
  if (names.empty()) names = text_list_attribute(dataset, "axes");
  return names.size() == 1 ? parts_of(names[0]) : names;
}

namespace {

/// The scale of each axis, the slowest one first; nothing where there is none.
std::vector<Hdf5Handle> scales_of(hid_t dataset, std::size_t axes) {
  std::vector<Hdf5Handle> scales(axes);
  const Hdf5Handle attribute(H5Aopen(dataset, "DIMENSION_LIST", H5P_DEFAULT), H5Aclose);
  const Hdf5Handle space(attribute ? H5Aget_space(attribute.get()) : -1, H5Sclose);
  const Hdf5Handle type(H5Tvlen_create(H5T_STD_REF_OBJ), H5Tclose);
  if (!space || H5Sget_simple_extent_npoints(space.get()) != static_cast<hssize_t>(axes)) return scales;
  std::vector<hvl_t> lists(axes, hvl_t{});
  if (H5Aread(attribute.get(), type.get(), lists.data()) < 0) return scales;
  for (std::size_t i = 0; i < axes; ++i) {
    if (lists[i].len == 0) continue;
    Hdf5Handle scale(H5Rdereference2(dataset, H5P_DEFAULT, H5R_OBJECT, lists[i].p), H5Oclose);
    if (scale && H5Iget_type(scale.get()) == H5I_DATASET) scales[i] = std::move(scale);
  }
  H5Dvlen_reclaim(type.get(), space.get(), H5P_DEFAULT, lists.data());
  return scales;
}

std::string own_name_of(hid_t object) {
  std::string name(static_cast<std::size_t>(std::max<ssize_t>(H5Iget_name(object, nullptr, 0), 0)), '\0');
  H5Iget_name(object, name.data(), name.size() + 1);
  return group_and_name(name).second;
}

/// NetCDF gives axes without positions a scale that has no numbers.
bool has_places(const Hdf5Handle& scale) {
  return scale && !attribute_in_words(scale.get(), "NAME").starts_with("This is a netCDF dimension but not");
}

/// Describes axes that are called x, y and z in another order by directions. `names` has the
/// slowest axis first.
void place_by_names(const std::string& object, const std::vector<std::string>& names, PlacesOfAxes& places) {
  Geometry& given = places.geometry;
  if (names.size() != 3 || !given.has_spacing || has_unknown_spacing(given) || !places.pairs.empty()) return;
  SpaceOfLetters space;
  if (given.has_origin) space.origin.emplace();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string letter = lower_case(names[2 - axis]);
    if (letter != "x" && letter != "y" && letter != "z") return;
    const auto row = static_cast<std::size_t>(letter[0] - 'x');
    space.steps[row][row] = given.spacing[axis];
    space.units[row] = given.units[axis];
    if (space.origin) (*space.origin)[row] = given.origin[axis];
  }
  const auto geometry = geometry_of_letters(names, space);
  if (!geometry || lower_case(names[0] + names[1] + names[2]) == "zyx") return;
  given = *geometry;
  places.are_axes_placed = true;
  places.warnings.push_back(fmt::format(
      "{}: its axes are {}, the slowest one first; samples stay in this order, and the directions describe "
      "the axes",
      object, fmt::join(names, ", ")));
}

/// Dimension scales, as netCDF 4 and h5py write them. Nothing if no axis has positions.
std::optional<PlacesOfAxes> places_of_scales(hid_t dataset, const std::string& path,
                                             const std::vector<hsize_t>& sizes) {
  const std::vector<Hdf5Handle> scales = scales_of(dataset, sizes.size());
  AxesOfVolume places(path, "hdf5_");
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t from_front = axis < sizes.size() ? sizes.size() - 1 - axis : sizes.size();
    if (from_front == sizes.size() || !has_places(scales[from_front])) {
      if (from_front == sizes.size() || sizes[from_front] == 1) places.add_none(axis);
      continue;
    }
    const std::string name = own_name_of(scales[from_front].get());
    AxisReading found = axis_of(scales[from_front].get(), sizes[from_front], path);
    if (found.axis)
      places.add(axis, name, std::move(*found.axis));
    else
      places.add_missing(axis, name, sizes[from_front], found.why_not);
  }
  if (std::ranges::none_of(scales, has_places)) return std::nullopt;
  PlacesOfAxes found = places.finish();
  place_by_names(path, names_of_scales(dataset), found);
  return found;
}

}  // namespace

std::vector<std::string> names_of_scales(hid_t dataset) {
  std::vector<std::string> names;
  for (const Hdf5Handle& scale : scales_of(dataset, dims_of(dataset).size()))
    names.push_back(scale ? own_name_of(scale.get()) : "");
  return std::ranges::all_of(names, &std::string::empty) ? std::vector<std::string>() : names;
}

std::optional<PlacesOfAxes> nexus_places(hid_t file, const std::string& path, const std::string& name,
                                         const std::vector<hsize_t>& sizes) {
  const auto [group_path, own_name] = group_and_name(name);
  const Hdf5Handle group = object_at(file, group_path);
  const Hdf5Handle dataset = opened_dataset(file, name);
  if (!group || !dataset) return std::nullopt;
  std::vector<std::string> names = names_of_nexus_axes(group.get(), dataset.get());
  const bool may_be_emd = names.empty();
  if (may_be_emd) names = emd_axes(group.get(), own_name, sizes.size());
  AxesOfVolume places(path, "hdf5_");
  if (names.size() != sizes.size()) {
    if (H5Aexists(dataset.get(), "DIMENSION_LIST") > 0) return places_of_scales(dataset.get(), path, sizes);
    const std::string axes =
        attribute_in_words(group.get(), "axes") + attribute_in_words(dataset.get(), "axes");
    if (axes.empty() || !is_nexus_signal(file, name)) return std::nullopt;
    PlacesOfAxes none;
    none.warnings.push_back(
        fmt::format("{}: the attribute axes of {} is {}, which does not name {} axes; the positions of "
                    "samples are unknown",
                    path, group_path, tagrid::quoted(axes), sizes.size()));
    return none;
  }
  // Outside of NeXus and EMD, the attribute may only say what axes are called.
  if (!may_be_emd && !is_nexus_signal(file, name) &&
      std::ranges::none_of(names, [&, &folder = group_path](const std::string& one) {
        return opened_dataset(file, inside(folder, one)) ||
               !why_missing(file, inside(folder, one)).starts_with("there is no ");
      }))
    return std::nullopt;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const bool is_there = axis < sizes.size();
    const std::size_t from_front = is_there ? sizes.size() - 1 - axis : 0;
    const std::uint64_t samples = is_there ? sizes[from_front] : 1;
    const std::string axis_name = is_there ? names[from_front] : ".";
    // "." is an axis without places.
    if (axis_name.empty() || axis_name == ".") {
      if (samples == 1) places.add_none(axis);
      continue;
    }
    const std::string indices = axis_name + "_indices";
    if (const auto given = number_attribute(group.get(), indices);
        !given.empty() && given != std::vector{static_cast<double>(from_front)}) {
      places.add_missing(axis, axis_name, samples,
                         fmt::format("{} is {}, but axes names it for index {}", indices,
                                     fmt::join(given, ", "), from_front));
      continue;
    }
    const std::string axis_path = inside(group_path, axis_name);
    const Hdf5Handle axis_dataset = opened_dataset(file, axis_path);
    AxisReading found = axis_dataset ? axis_of(axis_dataset.get(), samples, path, may_be_emd)
                                     : AxisReading{std::nullopt, why_missing(file, axis_path)};
    if (found.axis)
      places.add(axis, axis_name, std::move(*found.axis));
    else
      places.add_missing(axis, axis_name, samples, found.why_not.empty() ? "it is a group" : found.why_not);
  }
  return places.finish();
}

std::vector<std::string> nexus_companions(hid_t file, const std::string& path, const std::string& name) {
  if (!is_nexus_signal(file, name)) return {};
  const auto [group_path, own_name] = group_and_name(name);
  const Hdf5Handle group = object_at(file, group_path), dataset = opened_dataset(file, name);
  std::vector<std::pair<std::string, const char*>> known = {
      {own_name + "_errors", "the errors"}, {"errors", "the errors"}, {own_name + "_weights", "the weights"},
      {own_name + "_mask", "a mask"},       {"mask", "a mask"},       {"pixel_mask", "a mask"}};
  if (const auto errors = text_attribute(dataset.get(), "uncertainties"))
    known.emplace_back(*errors, "the errors");
  std::vector<std::string> sentences;
  for (const auto& [companion, what] : known)
    if (!companion.empty() && companion != own_name && has_link(group.get(), companion))
      sentences.push_back(fmt::format("{}: {} has {} of the samples of {}; it is not read", path,
                                      inside(group_path, companion), what, name));
  return sentences;
}

}  // namespace tagrid
