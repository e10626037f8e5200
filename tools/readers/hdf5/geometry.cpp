#include "tools/readers/hdf5/geometry.h"

#include <algorithm>
#include <cmath>

#include "tools/hdf5/attributes.h"

namespace tagrid {

Geometry geometry_of_dataset(hid_t dataset) {
  Geometry geometry;
  const auto is_good = [](double number) { return std::isfinite(number) && number != 0; };
  if (const auto spacing = number_attribute(dataset, "spacing");
      spacing.size() == 3 && std::ranges::all_of(spacing, is_good)) {
    std::ranges::copy(spacing, geometry.spacing.begin());
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

}  // namespace tagrid
