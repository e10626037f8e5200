// The shape of an array that tifffile (https://github.com/cgohlke/tifffile) writes into the description of
// the first page.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace tagrid {

struct TiffShape {
  std::size_t images = 1;  ///< the product of all axes but the last two
  bool is_of_slices =
      true;  ///< One of these axes is longer than 1 at most, and not called channels or the like.
  bool is_truncated = false;  ///< Only the first image has a page.
  std::string text;           ///< those axes: "2 x 3"
};

/// One image if the description has no shape.
TiffShape shape_in(std::string_view description);

}  // namespace tagrid
