// JPEG XL through libjxl.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace tagrid {

/// An image of one gray component without a sign.
struct JpegXlImage {
  std::int64_t width = 0, height = 0;
  int bits = 0;
  /// False if samples were converted to other colors before they were compressed, which loses some digits. If it
  /// is true, they may have lost some all the same.
  bool has_own_colors = false;
  std::vector<std::uint16_t> samples;
};

/// Decodes a code stream, or the content of a file. Throws BrokenInput if it is broken, is not of the expected
/// size, or is not one gray image of integers of at most 16 bits. Bytes after it do not count.
JpegXlImage decode_jpeg_xl(std::span<const std::byte> bytes, std::int64_t width, std::int64_t height);

/// Reads only the header, of which not more needs to be there: an image without samples. Throws BrokenInput.
JpegXlImage jpeg_xl_header(std::span<const std::byte> bytes);

}  // namespace tagrid
