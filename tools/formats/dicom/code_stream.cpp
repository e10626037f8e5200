#include "tools/formats/dicom/code_stream.h"

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "tools/formats/codecs/jpeg2000.h"

namespace tagrid {
namespace {

/// Of a stream; its header is at its beginning.
constexpr std::uint64_t most_bytes = 1 << 16;

/// The length of an item, which its tag and four bytes say.
std::uint64_t length_at(const ByteSource& file, std::uint64_t item) {
  std::byte bytes[4];
  if (item + 8 > file.size()) throw BrokenInput("ends too soon");
  file.read_at(item + 4, bytes);
  return load_little_endian<std::uint32_t>(bytes);
}

std::vector<std::byte> beginning_of_stream(const ByteSource& file, std::uint64_t fragments) {
  const std::uint64_t begin = first_stream(file, fragments);
  const std::uint64_t length = length_at(file, begin - 8);
  std::vector<std::byte> bytes(std::min({length, most_bytes, file.size() - begin}));
  file.read_at(begin, bytes);
  return bytes;
}

/// The error of samples that a JPEG-LS stream allows (NEAR in its scan); nothing if there is no such scan.
std::optional<int> error_of_jpeg_ls(std::span<const std::byte> bytes) {
  const auto at = [&](std::size_t i) { return std::to_integer<unsigned>(bytes[i]); };
  constexpr unsigned start_of_scan = 0xDA;
  for (std::size_t i = 2; i + 5 <= bytes.size() && at(i) == 0xFF;) {
    if (at(i + 1) == start_of_scan) {
      const std::size_t near = i + 5 + std::size_t{2} * at(i + 4);
      return near < bytes.size() ? std::optional<int>(at(near)) : std::nullopt;
    }
    i += 2 + (std::size_t{at(i + 2)} << 8 | at(i + 3));
  }
  return std::nullopt;
}

}  // namespace

std::uint64_t first_stream(const ByteSource& file, std::uint64_t fragments) {
  return fragments + 8 + length_at(file, fragments) + 8;
}

std::optional<bool> has_lossy_stream(const std::string& path, const DicomPixels& pixels) {
  const bool is_jpeg_ls =
      pixels.syntax == "1.2.840.10008.1.2.4.80" || pixels.syntax == "1.2.840.10008.1.2.4.81";
  if (!pixels.is_jpeg2000() && !is_jpeg_ls) return std::nullopt;
  try {
    const std::vector<std::byte> stream = beginning_of_stream(FileSource(path), *pixels.encapsulated);
    if (pixels.is_jpeg2000()) return !jpeg2000_header(stream).is_lossless;
    const auto error = error_of_jpeg_ls(stream);
    return error ? std::optional(*error > 0) : std::nullopt;
  } catch (const BrokenInput&) {
    return std::nullopt;  // decoding it will say what is wrong
  }
}

}  // namespace tagrid
