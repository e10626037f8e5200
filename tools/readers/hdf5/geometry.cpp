#include "tools/readers/hdf5/geometry.h"

#include <algorithm>
#include <cmath>

#include "tools/hdf5/attributes.h"
#include "tools/hdf5/description.h"
#include "tools/readers/hdf5/datasets.h"
#include "tools/readers/hdf5/image_data.h"
#include "tools/readers/hdf5/nexus.h"

namespace tagrid {
namespace {

/// What the attributes of the data set say.
Geometry geometry_of_attributes(hid_t dataset) {
  Geometry geometry;
  const auto is_good = [](double number) { return std::isfinite(number) && number != 0; };
  const auto is_unknown = [](double number) { return std::isnan(number); };
  if (const auto spacing = number_attribute(dataset, "spacing");
      spacing.size() == 3 && !std::ranges::all_of(spacing, is_unknown) &&
      std::ranges::all_of(spacing, [&](double number) { return is_unknown(number) || is_good(number); })) {
    std::ranges::copy(spacing, geometry.spacing.begin());
    geometry.units.fill(text_attribute(dataset, "spacing_units").value_or(""));
    geometry.has_spacing = true;
  } else if (const auto size = number_attribute(dataset, "element_size_um");
             size.size() == 3 && std::ranges::all_of(size, is_good)) {
    geometry.spacing = {size[2], size[1], size[0]};
    geometry.has_spacing = true;
    geometry.units.fill("um");
  }
  if (const auto d = number_attribute(dataset, "directions"); d.size() == 9) {
    for (std::size_t i = 0; i < 9; ++i) geometry.directions[i / 3][i % 3] = d[i];
    const double volume = determinant(geometry.directions);
    geometry.has_directions = std::isfinite(volume) && volume != 0;
  }
  if (const auto origin = number_attribute(dataset, "origin");
      origin.size() == 3 && std::ranges::all_of(origin, [](double n) { return std::isfinite(n); })) {
    std::ranges::copy(origin, geometry.origin.begin());
    geometry.has_origin = true;
  }
  geometry.space = text_attribute(dataset, "space").value_or("");
  return geometry;
}

Rescale rescale_of(hid_t dataset) {
  const auto slope = number_attribute(dataset, "rescale_slope"),
             intercept = number_attribute(dataset, "rescale_intercept");
  const bool is_good = slope.size() == 1 && std::isfinite(slope[0]) && slope[0] != 0 &&
                       intercept.size() <= 1 && (intercept.empty() || std::isfinite(intercept[0]));
  if (!is_good) return {};
  return {slope[0], intercept.empty() ? 0 : intercept[0],
          text_attribute(dataset, "rescale_units").value_or("")};
}

/// The attributes that are not among `known`, as pairs.
KeyValues other_attributes(hid_t dataset, const std::vector<std::string>& known) {
  KeyValues pairs;
  for (auto& [key, value] : all_attributes(dataset))
    if (key != hdf5_header_attribute && std::ranges::find(known, key) == known.end())
      pairs.emplace_back("hdf5_" + key, std::move(value));
  return pairs;
}

}  // namespace

DatasetDescription description_of_dataset(hid_t file, const std::string& path, const std::string& name,
                                          const Index3& dims) {
  const Hdf5Handle dataset = opened_dataset(file, name);
  DatasetDescription description;
  description.rescale = rescale_of(dataset.get());
  std::vector<std::string> known;
  if (const auto header = header_of(dataset.get(), known)) {
    description.nrrd = *header + (header->empty() || header->ends_with('\n') ? "" : "\n") +
                       nrrd_fields_of({}, other_attributes(dataset.get(), known));
    return description;
  }
  Geometry geometry = geometry_of_attributes(dataset.get());
  KeyValues pairs = {{"hdf5_dataset", name}};
  if (!geometry.has_spacing && !geometry.has_directions) {
    if (const auto image = geometry_of_image_data(file, name, dims)) {
      geometry = *image;
    } else if (auto places = nexus_places(file, path, name, dims_of(dataset.get()))) {
      geometry = places->geometry;
      pairs.insert(pairs.end(), places->pairs.begin(), places->pairs.end());
      description.warnings = std::move(places->warnings);
    }
  }
  if (description.rescale != Rescale{}) known = {"rescale_slope", "rescale_intercept", "rescale_units"};
  for (auto& pair : other_attributes(dataset.get(), known)) pairs.push_back(std::move(pair));
  add_rescale(description.rescale, pairs);
  description.nrrd = nrrd_fields_of(geometry, pairs);
  return description;
}

}  // namespace tagrid
