// What code streams say of themselves, which may be other than what their file says: JPEG and RLE.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

namespace tagrid {

/// The frame header of a JPEG code stream (ISO 10918-1, B.2.2).
struct JpegFrame {
  int bits = 0, rows = 0, columns = 0, components = 0;
};

/// Nothing if the bytes, which are the beginning of a stream, have no frame header.
std::optional<JpegFrame> jpeg_frame(std::span<const std::byte> beginning);

/// Decodes a frame of RLE (DICOM PS3.5, annex G) to `count` integers of `size` bytes, in the machine's byte
/// order. The stream holds their most significant bytes first, then the next ones, and so on. Throws
/// BrokenInput if it holds other ones, fewer or more.
void decode_rle(std::span<const std::byte> stream, std::size_t size, std::size_t count, std::byte* out);

}  // namespace tagrid
