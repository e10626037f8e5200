// What ImageJ writes into the description of the first page.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace tagrid {

/// Planes follow each other by channel, then slice, then frame: channels change fastest.
struct ImageJ {
  std::int64_t images = 1, channels = 1, slices = 1, frames = 1;
  double spacing = 0;  ///< between slices; 0: not given
  std::string unit;    ///< of lengths; "" if none is given
};

/// Nothing if the description is not ImageJ's. Throws BrokenInput if its numbers do not fit each other.
std::optional<ImageJ> image_j_of(std::string_view description);

/// "um" for "micron" and the like, other units as they are.
std::string plain_unit(std::string_view unit);

}  // namespace tagrid
