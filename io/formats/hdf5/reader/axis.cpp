#include "io/formats/hdf5/reader/axis.h"
#include "io/formats/hdf5/reader/links.h"

#include <fmt/format.h>

#include <limits>

#include "io/formats/hdf5/attributes.h"
#include "io/formats/hdf5/reader/datasets.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

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
  if (dims.size() != 1) return dims.empty() ? "it is not a list" : fmt::format("it has {} axes", dims.size());
  return dims[0] > most_places_of_axis ? "it is too long" : "";
}

/// EMD writes "[n_m]" for nm.
std::string unit_of(hid_t dataset) {
  std::string unit = attribute_in_words(dataset, "units");
  if (!unit.starts_with('[') || !unit.ends_with(']')) return unit;
  std::erase(unit, '_');
  return unit.substr(1, unit.size() - 2);
}

double epsilon_of(hid_t dataset) {
  const Hdf5Handle type(H5Dget_type(dataset), H5Tclose);
  if (H5Tget_class(type.get()) != H5T_FLOAT) return 0;
  return H5Tget_size(type.get()) <= 4 ? std::numeric_limits<float>::epsilon()
                                      : std::numeric_limits<double>::epsilon();
}

}  // namespace

AxisReading axis_of(hid_t dataset, std::uint64_t samples, const std::string& path, bool may_be_first_two) {
  if (std::string why = why_not_own_numbers(dataset, path); !why.empty()) return {std::nullopt, why};
  std::vector<double> numbers(dims_of(dataset)[0]);
  if (H5Dread(dataset, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data()) < 0)
    return {std::nullopt, "it cannot be read"};
  AxisReading found = axis_of_numbers(std::move(numbers), samples, epsilon_of(dataset), may_be_first_two);
  if (found.axis) found.axis->unit = unit_of(dataset);
  return found;
}

std::vector<std::string> emd_axes(hid_t group, const std::string& name, std::size_t axes) {
  if (name != "data" || H5Aexists(group, "emd_group_type") <= 0) return {};
  // Version 1.0 counts from 0.
  const std::size_t first = has_link(group, "dim0") ? 0 : 1;
  std::vector<std::string> found;
  for (std::size_t i = 0; i < axes; ++i) found.push_back(fmt::format("dim{}", first + i));
  return found;
}

std::vector<std::string> names_of_emd_axes(hid_t group, const std::string& name, std::size_t axes) {
  std::vector<std::string> names;
  for (const std::string& axis : emd_axes(group, name, axes)) {
    const Hdf5Handle dataset = opened_dataset(group, axis);
    const auto texts = dataset ? text_list_attribute(dataset.get(), "name") : std::vector<std::string>();
    names.push_back(texts.empty() ? "" : texts.front());
  }
  return names;
}

}  // namespace tagrid
