#include "tools/readers/hdf5/axis.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tools/hdf5/attributes.h"
#include "tools/readers/hdf5/datasets.h"

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

double median(std::vector<double> numbers) {
  const auto middle = numbers.begin() + static_cast<std::ptrdiff_t>(numbers.size() / 2);
  std::ranges::nth_element(numbers, middle);
  return *middle;
}

/// Numbers of the file itself: external storage could be any file of this machine.
std::vector<double> own_numbers(hid_t dataset, const std::string& path) {
  const Hdf5Handle properties(H5Dget_create_plist(dataset), H5Pclose);
  const Hdf5Handle type(H5Dget_type(dataset), H5Tclose);
  const H5T_class_t kind = H5Tget_class(type.get());
  const std::vector<hsize_t> dims = dims_of(dataset);
  if (!properties || H5Pget_external_count(properties.get()) != 0 ||
      H5Pget_layout(properties.get()) == H5D_VIRTUAL || (kind != H5T_INTEGER && kind != H5T_FLOAT) ||
      dims.size() != 1 || dims[0] == 0 || dims[0] > most_places || !is_in_folder_of(path, dataset))
    return {};
  std::vector<double> numbers(dims[0]);
  if (H5Dread(dataset, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data()) < 0) return {};
  return numbers;
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

std::optional<Axis> axis_of(hid_t dataset, std::uint64_t samples, const std::string& path) {
  Axis axis{.places = own_numbers(dataset, path), .unit = text_attribute(dataset, "units").value_or("")};
  if (!std::ranges::all_of(axis.places, [](double place) { return std::isfinite(place); }))
    return std::nullopt;
  axis.rounding = rounding_of(dataset, axis.places);
  if (axis.places.size() == samples + 1) {
    for (std::size_t i = 0; i < samples; ++i) {
      axis.width = std::abs(axis.places[i + 1] - axis.places[i]);
      axis.places[i] += (axis.places[i + 1] - axis.places[i]) / 2;
    }
    axis.places.pop_back();
  }
  if (axis.places.size() != samples) return std::nullopt;
  return axis;
}

}  // namespace tagrid
