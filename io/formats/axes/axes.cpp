#include "io/formats/axes/axes.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "io/programs/stored_samples.h"

namespace tagrid {
namespace {

/// Positions count as evenly spaced if they deviate from a straight line by less than this part of
/// a step. Comparing steps would not be enough, because small differences of many steps add up.
constexpr double same_place = 0.01;
/// Longer lists of places are not kept as a pair.
constexpr std::size_t most_kept = 1 << 14;

std::vector<double> steps_of(const std::vector<double>& places) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < places.size(); ++i) steps.push_back(places[i] - places[i - 1]);
  return steps;
}

}  // namespace

double Axis::step() const {
  if (places.size() < 2) return width > 0 ? width : std::numeric_limits<double>::quiet_NaN();
  if (is_even()) return (places.back() - places.front()) / static_cast<double>(places.size() - 1);
  return median(steps_of(places));
}

bool Axis::is_even() const {
  if (places.size() < 2) return true;
  const double first = places.front(),
               mean = (places.back() - first) / static_cast<double>(places.size() - 1),
               tolerance = std::max(same_place * std::abs(mean), 2 * rounding);
  for (std::size_t i = 0; i < places.size(); ++i)
    if (!(std::abs(places[i] - (first + mean * static_cast<double>(i))) <= tolerance)) return false;
  return is_sorted();
}

bool Axis::is_sorted() const {
  const std::vector<double> steps = steps_of(places);
  return std::ranges::all_of(steps, [](double step) { return step > 0; }) ||
         std::ranges::all_of(steps, [](double step) { return step < 0; });
}

AxisReading axis_of_numbers(std::vector<double> numbers, std::uint64_t samples, double epsilon,
                            bool may_be_first_two) {
  Axis axis;
  axis.places = std::move(numbers);
  const bool are_first_two =
      may_be_first_two && axis.places.size() == 2 && samples > 2 && samples <= most_places_of_axis;
  if (axis.places.size() != samples && axis.places.size() != samples + 1 && !are_first_two)
    return {std::nullopt, fmt::format("it has {}", axis.places.size())};
  for (std::size_t i = 0; i < axis.places.size(); ++i) {
    if (!std::isfinite(axis.places[i]))
      return {std::nullopt, fmt::format("number {} is {}", i + 1, axis.places[i])};
    axis.rounding = std::max(axis.rounding, epsilon * std::abs(axis.places[i]));
  }
  if (are_first_two) {
    const double first = axis.places[0], step = axis.places[1] - first;
    axis.places.resize(samples);
    for (std::size_t i = 0; i < samples; ++i) axis.places[i] = first + step * static_cast<double>(i);
  }
  if (axis.places.size() == samples + 1) {
    for (std::size_t i = 0; i < samples; ++i) {
      axis.width = std::abs(axis.places[i + 1] - axis.places[i]);
      axis.places[i] += (axis.places[i + 1] - axis.places[i]) / 2;
    }
    axis.places.pop_back();
  }
  return {std::move(axis), ""};
}

double UnitOfAxes::convert(std::size_t axis, double length) const {
  return conversions[axis] ? converted(length, conversions[axis]->from, conversions[axis]->to) : length;
}

UnitOfAxes common_unit(const std::array<std::string, 3>& units, const std::array<bool, 3>& used) {
  UnitOfAxes common = {units, {}, ""};
  std::array<std::optional<LengthUnit>, 3> lengths;
  std::optional<std::size_t> chosen;
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (used[axis]) lengths[axis] = length_unit(units[axis]);
  const auto frequency = [&](std::size_t axis) { return std::ranges::count(lengths, lengths[axis]); };
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (lengths[axis] && (!chosen || frequency(axis) > frequency(*chosen))) chosen = axis;
  for (std::size_t axis = 0; chosen && axis < 3; ++axis) {
    if (!lengths[axis]) continue;
    if (lengths[axis] != lengths[*chosen]) common.conversions[axis] = {*lengths[axis], *lengths[*chosen]};
    common.units[axis] = units[*chosen];
  }
  std::string list;
  bool is_one = true;
  std::optional<std::size_t> first;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!used[axis]) continue;
    if (!first) first = axis;
    is_one &= common.units[axis] == common.units[*first];
    list += fmt::format("{}{} {}", list.empty() ? "" : ", ", "xyz"[axis],
                        units[axis].empty() ? "none" : units[axis]);
  }
  if (!is_one)
    common.remark = fmt::format(
        "its axes have units that cannot be converted into each other ({}); distances are kept as they are, "
        "and other formats may take them for distances in one unit",
        list);
  return common;
}

Metadata metadata_of_places(const Geometry& geometry, const KeyValues& pairs) {
  if (geometry.has_spacing || geometry.has_directions || !geometry.has_origin)
    return Metadata(geometry, pairs);
  MetadataEntries entries;
  if (geometry.space.empty())
    entries.add_field("space dimension", "3");
  else
    entries.add_field("space", geometry.space);
  const auto& [x, y, z] = geometry.origin;
  entries.add_field("space origin", fmt::format("({},{},{})", x, y, z));
  std::string units;
  for (const std::string& unit : geometry.units)
    if (unit.find_first_of("\"\\\n") == unit.npos)
      units += fmt::format("{}\"{}\"", units.empty() ? "" : " ", unit);
  if (geometry.units != std::array<std::string, 3>{}) entries.add_field("units", units);
  for (const auto& [key, text] : pairs) entries.add_pair(key, text);
  return Metadata(std::move(entries));
}

void AxesOfVolume::add(std::size_t axis, const std::string& name, Axis places) {
  names_[axis] = name;
  axes_[axis] = std::move(places);
}

void AxesOfVolume::add_missing(std::size_t axis, const std::string& name, std::uint64_t samples,
                               const std::string& why) {
  found_.warnings.push_back(fmt::format(
      "{}: the axis {} is not a list of {} positions ({}), so the positions of samples along {} are unknown",
      path_, name, samples, why, "xyz"[axis]));
}

PlacesOfAxes AxesOfVolume::finish() {
  convert_units();
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (axes_[axis]) place(axis, names_[axis], std::move(*axes_[axis]));
  Geometry& geometry = found_.geometry;
  geometry.has_spacing =
      std::ranges::any_of(geometry.spacing, [](double spacing) { return !std::isnan(spacing); });
  geometry.has_origin = geometry.has_spacing && std::ranges::all_of(is_placed_, [](bool is) { return is; });
  if (!geometry.has_origin) geometry.origin = {};
  if (uneven_) keep_slices();
  return std::move(found_);
}

void AxesOfVolume::convert_units() {
  std::array<std::string, 3> units;
  std::array<bool, 3> used = {};
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (axes_[axis]) {
      units[axis] = axes_[axis]->unit;
      used[axis] = axes_[axis]->places.size() > 1 || axes_[axis]->width > 0 || !units[axis].empty();
    }
  const UnitOfAxes common = common_unit(units, used);
  if (!common.remark.empty()) found_.warnings.push_back(fmt::format("{}: {}", path_, common.remark));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!axes_[axis]) continue;
    axes_[axis]->unit = common.units[axis];
    if (!common.conversions[axis]) continue;
    for (double& place : axes_[axis]->places) place = common.convert(axis, place);
    axes_[axis]->rounding = common.convert(axis, axes_[axis]->rounding);
    axes_[axis]->width = common.convert(axis, axes_[axis]->width);
  }
}

void AxesOfVolume::place(std::size_t axis, const std::string& name, Axis places) {
  found_.geometry.units[axis] = places.unit;
  if (!places.is_even() && !(axis == 2 && places.is_sorted())) return leave_out(axis, name, places);
  found_.geometry.spacing[axis] = places.step();
  if (std::isnan(places.step()) || places.step() == 0) found_.geometry.spacing[axis] = Geometry::unknown;
  found_.geometry.origin[axis] = places.places.front();
  is_placed_[axis] = true;
  if (!places.is_even()) uneven_ = std::move(places);
}

void AxesOfVolume::leave_out(std::size_t axis, const std::string& name, const Axis& places) {
  const bool is_kept = places.places.size() <= most_kept;
  found_.warnings.push_back(
      fmt::format("{}: samples along {} lie at unequal distances (axis {}), which is not supported; the "
                  "spacing along {} is left out{}",
                  path_, "xyz"[axis], name, "xyz"[axis],
                  is_kept ? fmt::format(", and the pair {}{} keeps the positions", prefix_, name) : ""));
  if (is_kept) found_.pairs.emplace_back(prefix_ + name, fmt::format("{}", fmt::join(places.places, " ")));
}

void AxesOfVolume::keep_slices() {
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
                  "but meshes are built with equal distances",
                  path_, smallest, largest));
}

}  // namespace tagrid
