// The contents of a JPEG 2000 file besides the image that is read: ISO/IEC 15444-1, annexes A and I.
#pragma once

#include <cstdint>

#include "io/files/byte_source.h"

namespace tagrid {

struct Jp2Outline {
  std::uint64_t images = 0;  ///< code streams; 0 if none was found
  std::uint64_t after = 0;   ///< bytes after the last box, or after the end of the code stream
  bool has_palette = false;  ///< Samples are numbers of colors.
  bool has_extensions =
      false;  ///< The code stream says that it needs more than part 1 of the standard, and part 15.
};

/// Walks over boxes, and over the parts of code streams, without decoding any. Of damaged files, which the
/// decoder refuses, as far as it comes. Safe for any bytes. Throws WorldError.
Jp2Outline jp2_outline(const ByteSource& file);

}  // namespace tagrid
