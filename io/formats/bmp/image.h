// Windows bitmaps (BMP) of 8-bit gray samples, as SkyScan's programs write slices.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "io/files/file_bytes.h"

namespace tagrid {

struct BmpImage {
  std::int64_t width = 0, height = 0;
  bool is_top_down = false;  ///< The first row in the file is the upper one; usually it is the lower one.
  std::uint64_t offset = 0;  ///< of the first row in the file
  int grays = 256;           ///< Samples are less than this.
  std::uint64_t after = 0;   ///< bytes after the samples and after any color profile that follows them

  /// Rows are filled up to multiples of four bytes.
  std::uint64_t row_bytes() const { return (static_cast<std::uint64_t>(width) + 3) / 4 * 4; }
};

/// True if these bytes, the first 18 or more of a file, begin a bitmap.
bool begins_bmp(std::string_view bytes);

/// Reads header and palette. Throws BrokenInput if the file is damaged or too short, or if its samples are
/// not plain 8-bit gray values: other depths, compressed, or with a palette in which entry i is not the gray
/// (i, i, i). Throws WorldError. Safe for any bytes.
BmpImage bmp_image(const ByteSource& file);

/// Reads all samples, x fastest, the upper row first. Throws BrokenInput if one is not in the palette, and
/// WorldError. REQUIRES: `image` is bmp_image(file); samples.size() is width * height.
void read_bmp(const ByteSource& file, const BmpImage& image, std::span<std::byte> samples);

}  // namespace tagrid
