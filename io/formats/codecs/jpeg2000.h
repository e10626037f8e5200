// JPEG 2000 through OpenJPEG.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace tagrid {

/// An image of one component.
struct Jpeg2000Image {
  std::int64_t width = 0, height = 0;
  int bits = 0;
  bool is_signed = false;
  bool is_lossless = false;  ///< by its wavelet: values are those that were encoded, unless bits were cut off
  std::vector<std::int32_t> samples;
};

/// Decodes a code stream or the content of a JP2 file. Throws BrokenInput if it is broken, has several
/// components, or is not of the size that is expected.
Jpeg2000Image decode_jpeg2000(std::span<const std::byte> bytes, std::int64_t width, std::int64_t height);

/// Reads only the header of a code stream, of which not more needs to be there: an image without samples.
/// Throws BrokenInput.
Jpeg2000Image jpeg2000_header(std::span<const std::byte> bytes);
/// Reads only the header of a file: an image without samples. Throws BrokenInput as above, and WorldError.
Jpeg2000Image jpeg2000_header(const std::string& path);
/// Decodes a file. The same.
Jpeg2000Image decode_jpeg2000_file(const std::string& path);

/// Stores the low bits of all samples, in `size` bytes each (1, 2 or 4), in the byte order of memory.
void store_samples(const Jpeg2000Image& image, std::size_t size, std::byte* out);

}  // namespace tagrid
