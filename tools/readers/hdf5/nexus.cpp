#include "tools/readers/hdf5/nexus.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "tools/hdf5/attributes.h"
#include "tools/readers/hdf5/axis.h"
#include "tools/readers/hdf5/datasets.h"

namespace tagrid {
namespace {

/// Longer lists of places are not kept as a pair.
constexpr std::size_t most_kept = 1 << 14;

std::pair<std::string, std::string> group_and_name(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  if (slash == path.npos) return {"/", path};
  return {slash == 0 ? "/" : path.substr(0, slash), path.substr(slash + 1)};
}

/// "z:y:x" or "[z,y,x]", as older files have it in the data set, become three names.
std::vector<std::string> parts_of(const std::string& text) {
  std::vector<std::string> parts(1);
  for (const char c : text)
    if (c == ':' || c == ',')
      parts.emplace_back();
    else if (c != '[' && c != ']' && c != ' ')
      parts.back() += c;
  return parts;
}

std::vector<std::string> names_of_axes(hid_t group, hid_t dataset) {
  std::vector<std::string> names = text_list_attribute(group, "axes");
  if (names.empty()) names = text_list_attribute(dataset, "axes");
  return names.size() == 1 ? parts_of(names[0]) : names;
}

/// Gathers what the axes say, in the order x, y, z.
class Places {
 public:
  explicit Places(const std::string& path) : path_(path) {}

  void add(std::size_t axis, const std::string& name, Axis places) {
    found_.geometry.units[axis] = places.unit;
    if (!places.is_even() && !(axis == 2 && places.is_sorted())) return leave_out(axis, name, places);
    found_.geometry.spacing[axis] = places.step();
    if (std::isnan(places.step()) || places.step() == 0) found_.geometry.spacing[axis] = Geometry::unknown;
    found_.geometry.origin[axis] = places.places.front();
    is_placed_[axis] = true;
    if (!places.is_even()) uneven_ = std::move(places);
  }
  void add_missing(std::size_t axis, const std::string& name, std::uint64_t samples) {
    found_.warnings.push_back(fmt::format(
        "{}: the axis {} is no list of {} places, so the places of samples along {} are not known", path_,
        name, samples, "xyz"[axis]));
  }
  /// There is only one sample along the axis, and nothing says where.
  void add_none(std::size_t axis) { is_placed_[axis] = true; }

  NexusPlaces finish() {
    Geometry& geometry = found_.geometry;
    geometry.has_spacing =
        std::ranges::any_of(geometry.spacing, [](double spacing) { return !std::isnan(spacing); });
    geometry.has_origin = geometry.has_spacing && std::ranges::all_of(is_placed_, [](bool is) { return is; });
    if (!geometry.has_origin) geometry.origin = {};
    if (uneven_) keep_slices();
    return std::move(found_);
  }

 private:
  void leave_out(std::size_t axis, const std::string& name, const Axis& places) {
    const bool is_kept = places.places.size() <= most_kept;
    found_.warnings.push_back(
        fmt::format("{}: samples along {} lie at unequal distances (axis {}), but those of a volume lie at "
                    "equal ones; the "
                    "spacing along {} is left out{}",
                    path_, "xyz"[axis], name, "xyz"[axis],
                    is_kept ? fmt::format(", and the pair hdf5_{} keeps their places", name) : ""));
    if (is_kept) found_.pairs.emplace_back("hdf5_" + name, fmt::format("{}", fmt::join(places.places, " ")));
  }

  void keep_slices() {
    const std::vector<double>& places = uneven_->places;
    const auto& origin = found_.geometry.origin;
    std::string positions;
    double smallest = std::abs(places[1] - places[0]), largest = smallest;
    for (std::size_t z = 0; z < places.size(); ++z) {
      positions += fmt::format("{}{} {} {}", z > 0 ? "; " : "", origin[0], origin[1], places[z]);
      if (z == 0) continue;
      smallest = std::min(smallest, std::abs(places[z] - places[z - 1]));
      largest = std::max(largest, std::abs(places[z] - places[z - 1]));
    }
    found_.pairs.emplace_back("slice_positions", positions);
    found_.warnings.push_back(
        fmt::format("{}: slices lie at unequal distances, from {} to {}; the position of each slice is kept, "
                    "but a mesh has equal steps",
                    path_, smallest, largest));
  }

  std::string path_;
  NexusPlaces found_;
  std::array<bool, 3> is_placed_ = {};
  std::optional<Axis> uneven_;
};

}  // namespace

std::string nexus_default(hid_t file) {
  std::string path = "/";
  for (int depth = 0; depth < 8; ++depth) {
    const Hdf5Handle group(H5Oopen(file, path.c_str(), H5P_DEFAULT), H5Oclose);
    if (!group) return "";
    if (const auto signal = text_attribute(group.get(), "signal")) return path + *signal;
    const auto next = text_attribute(group.get(), "default");
    if (!next || next->empty()) return "";
    path += *next + "/";
  }
  return "";
}

bool is_nexus_signal(hid_t file, const std::string& path) {
  const auto [group_path, name] = group_and_name(path);
  const Hdf5Handle group(H5Oopen(file, group_path.c_str(), H5P_DEFAULT), H5Oclose);
  if (group && text_attribute(group.get(), "signal") == name) return true;
  // As older files have it.
  const Hdf5Handle dataset = opened_dataset(file, path);
  return dataset && (text_attribute(dataset.get(), "signal") == "1" ||
                     number_attribute(dataset.get(), "signal") == std::vector<double>{1});
}

std::optional<NexusPlaces> nexus_places(hid_t file, const std::string& path, const std::string& name,
                                        const std::vector<hsize_t>& sizes) {
  const std::string group_path = group_and_name(name).first;
  const Hdf5Handle group(H5Oopen(file, group_path.c_str(), H5P_DEFAULT), H5Oclose);
  const Hdf5Handle dataset = opened_dataset(file, name);
  if (!group || !dataset) return std::nullopt;
  const std::vector<std::string> names = names_of_axes(group.get(), dataset.get());
  if (names.size() != sizes.size()) return std::nullopt;
  Places places(path);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const bool is_there = axis < sizes.size();
    const std::size_t from_front = is_there ? sizes.size() - 1 - axis : 0;
    const std::uint64_t samples = is_there ? sizes[from_front] : 1;
    const std::string axis_name = is_there ? names[from_front] : ".";
    // "." is an axis without places.
    const Hdf5Handle axis_dataset =
        axis_name.empty() || axis_name == "." ? Hdf5Handle() : opened_dataset(group.get(), axis_name);
    if (!axis_dataset) {
      if (samples == 1) places.add_none(axis);
      continue;
    }
    if (auto found = axis_of(axis_dataset.get(), samples, path))
      places.add(axis, axis_name, std::move(*found));
    else
      places.add_missing(axis, axis_name, samples);
  }
  return places.finish();
}

}  // namespace tagrid
