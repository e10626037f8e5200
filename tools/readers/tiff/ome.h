// OME-XML in the description of the first page: https://docs.openmicroscopy.org/ome-model/
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tagrid {

/// Where a plane is.
struct OmePlane {
  std::string file;        ///< its name, beside the file with the description; "" for that file itself
  std::int64_t page = -1;  ///< -1: nowhere
};

/// An image with slices, channels and moments.
struct OmeImage {
  std::string name;
  std::int64_t slices = 1, channels = 1, times = 1;
  std::vector<OmePlane> planes;               ///< plane (z, c, t) is number z + slices * (c + channels * t)
  std::array<double, 3> spacing = {0, 0, 0};  ///< in `unit`; 0: not given
  std::string unit;
};

/// Nothing if the description is not OME-XML. `pages` are those of the file with the description. Throws BrokenInput.
std::optional<std::vector<OmeImage>> ome_images_of(std::string_view description, std::int64_t pages);

}  // namespace tagrid
