// What ImageJ writes into the description of the first page.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "io/text/foreign_number.h"
#include "tools/formats/tiff/remarks.h"
#include "tools/formats/tiff/tiff_page.h"

namespace tagrid {

/// Planes follow each other by channel, then slice, then frame: channels change fastest.
struct ImageJ {
  std::int64_t images = 1, channels = 1, slices = 1, frames = 1;
  ForeignNumber spacing;            ///< between slices
  std::array<std::string, 3> unit;  ///< of lengths along x, y, z; "" if none is given
};

/// Nothing if the description is not ImageJ's. Throws BrokenInput if its numbers do not fit each other.
std::optional<ImageJ> image_j_of(std::string_view description);

/// The spacing of a stack whose first page is `first`. Resolutions are lengths if ImageJ gives a unit;
/// otherwise they are those of paper.
Geometry spacing_of(const ImageJ& image_j, const TiffPage& first, TiffRemarks& remarks);

}  // namespace tagrid
