#include "tools/formats/hdf5/reader/axis.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "io/text/text.h"
#include "tools/formats/hdf5/attributes.h"
#include "tools/formats/hdf5/reader/datasets.h"
#include "tools/formats/stored_samples.h"

namespace tagrid {
namespace {

/// Steps that differ by less, relative to the usual one, are equal.
constexpr double same_step = 0.01;
constexpr std::uint64_t most_places = std::uint64_t{1} << 22;

std::vector<double> steps_of(const std::vector<double>& places) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < places.size(); ++i) steps.push_back(places[i] - places[i - 1]);
  return steps;
}

/// Why the data set is no list of numbers of its own; "" if it is one.
std::string why_not_own_numbers(hid_t dataset, const std::string& path) {
  const Hdf5Handle type(H5Dget_type(dataset), H5Tclose);
  const H5T_class_t kind = H5Tget_class(type.get());
  const std::vector<hsize_t> dims = dims_of(dataset);
  if (!has_own_samples(path, dataset)) return "its numbers are in other files";
  if (kind != H5T_INTEGER && kind != H5T_FLOAT) return "it has " + samples_in_words(type.get());
  for (const char* packed : {"scale_factor", "add_offset"})
    if (H5Aexists(dataset, packed) > 0)
      return fmt::format("its attribute {} is {}, and packed places are not supported", packed,
                         tagrid::quoted(attribute_in_words(dataset, packed)));
  if (dims.size() != 1) return dims.empty() ? "it is no list" : fmt::format("it has {} axes", dims.size());
  return dims[0] > most_places ? "it is too long" : "";
}

/// EMD writes "[n_m]" for nm.
std::string unit_of(hid_t dataset) {
  std::string unit = attribute_in_words(dataset, "units");
  if (!unit.starts_with('[') || !unit.ends_with(']')) return unit;
  std::erase(unit, '_');
  return unit.substr(1, unit.size() - 2);
}

double rounding_of(hid_t dataset, const std::vector<double>& numbers) {
  const Hdf5Handle type(H5Dget_type(dataset), H5Tclose);
  if (H5Tget_class(type.get()) != H5T_FLOAT) return 0;
  const double epsilon = H5Tget_size(type.get()) <= 4 ? std::numeric_limits<float>::epsilon()
                                                      : std::numeric_limits<double>::epsilon();
  double largest = 0;
  for (const double number : numbers) largest = std::max(largest, std::abs(number));
  return epsilon * largest;
}

}  // namespace

double Axis::step() const {
  if (places.size() < 2) return width > 0 ? width : std::numeric_limits<double>::quiet_NaN();
  if (is_even()) return (places.back() - places.front()) / static_cast<double>(places.size() - 1);
  return median(steps_of(places));
}

bool Axis::is_even() const {
  const std::vector<double> steps = steps_of(places);
  if (steps.empty()) return true;
  const double usual = median(steps);
  const double tolerance = std::max(same_step * std::abs(usual), 2 * rounding);
  return is_sorted() &&
         std::ranges::all_of(steps, [&](double step) { return std::abs(step - usual) <= tolerance; });
}

bool Axis::is_sorted() const {
  const std::vector<double> steps = steps_of(places);
  return std::ranges::all_of(steps, [](double step) { return step > 0; }) ||
         std::ranges::all_of(steps, [](double step) { return step < 0; });
}

AxisReading axis_of(hid_t dataset, std::uint64_t samples, const std::string& path, bool may_be_first_two) {
  if (std::string why = why_not_own_numbers(dataset, path); !why.empty()) return {std::nullopt, why};
  Axis axis{.places = std::vector<double>(dims_of(dataset)[0]), .unit = unit_of(dataset)};
  const bool are_first_two =
      may_be_first_two && axis.places.size() == 2 && samples > 2 && samples <= most_places;
  if (axis.places.size() != samples && axis.places.size() != samples + 1 && !are_first_two)
    return {std::nullopt, fmt::format("it has {}", axis.places.size())};
  if (H5Dread(dataset, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, axis.places.data()) < 0)
    return {std::nullopt, "it cannot be read"};
  for (std::size_t i = 0; i < axis.places.size(); ++i)
    if (!std::isfinite(axis.places[i]))
      return {std::nullopt, fmt::format("number {} is {}", i + 1, axis.places[i])};
  axis.rounding = rounding_of(dataset, axis.places);
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
        "its axes have units that cannot be converted into each other ({}); distances along them are kept as "
        "they are, and other formats may take them for distances in one unit",
        list);
  return common;
}

}  // namespace tagrid
