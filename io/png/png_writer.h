// PNG files.
#pragma once

#include <cstddef>
#include <span>

#include "io/files/output_file.h"

namespace tagrid {

/// Writes a picture as PNG, 8 bits of red, green and blue, rows from top to bottom. The file has no time and
/// no text, so that the same picture always gives the same bytes, if libpng and zlib are the same. Throws
/// what `out` throws. REQUIRES: pixels.size() == 3 * width * height; sizes are positive.
void write_png(int width, int height, std::span<const std::byte> pixels, ByteSink& out);

}  // namespace tagrid
