// The samples of PNG files, through libpng.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "io/formats/png/outline.h"

namespace tagrid {

/// Decodes the samples of the file at `path`, x fastest, those of 16 bits with the most significant byte first, as
/// in the file. Throws BrokenInput if it is damaged, and WorldError. REQUIRES: `outline` is that of the file, and
/// samples.size() is width * height * bits / 8.
void read_png(const std::string& path, const PngOutline& outline, std::span<std::byte> samples);

}  // namespace tagrid
