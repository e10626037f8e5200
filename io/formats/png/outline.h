// What a PNG file says before its samples are decoded: https://www.w3.org/TR/png
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "io/files/file_bytes.h"

namespace tagrid {

struct PngOutline {
  std::int64_t width = 0, height = 0;
  int bits = 8;  ///< of a gray sample: 8 or 16
  /// Samples per meter along x and y; 0 if that is not stated.
  double x_per_meter = 0, y_per_meter = 0;
  bool has_transparent = false;  ///< Samples of one value stand for nothing.
  bool has_more_images = false;  ///< an animation, of which this is the first image
  std::uint64_t after = 0;       ///< bytes after the last chunk
};

/// Bytes that begins_gray_png() needs.
inline constexpr std::size_t png_header_bytes = 26;
/// True if these bytes begin a PNG file of gray samples of 8 or 16 bits, without transparency.
bool begins_gray_png(std::string_view bytes);

/// Walks over the chunks of a file. Throws BrokenInput if it is not such a file, or does not have all of its
/// chunks; WorldError. Safe for any bytes.
PngOutline png_outline(const ByteSource& file);

}  // namespace tagrid
