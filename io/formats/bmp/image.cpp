#include "io/formats/bmp/image.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"

namespace tagrid {
namespace {

constexpr std::size_t file_header = 14;
/// What follows the file header begins with its own size, one of these.
constexpr std::uint32_t core_header = 12;
constexpr std::array<std::uint32_t, 6> header_sizes = {core_header, 40, 52, 56, 108, 124};

template <class Number>
Number number(std::span<const std::byte> bytes, std::size_t at) {
  return load_little_endian<Number>(bytes.data() + at);
}

[[noreturn]] void refuse(const ByteSource& file, std::string_view why) {
  throw BrokenInput("{}: BMP file: {}", file.name(), why);
}

std::vector<std::byte> bytes_of(const ByteSource& file, std::uint64_t from, std::uint64_t size) {
  if (file.size() < from || file.size() - from < size) refuse(file, "ends within its header");
  std::vector<std::byte> bytes(size);
  file.read_at(from, bytes);
  return bytes;
}

/// Without a ramp of grays, numbers are not brightness.
void require_grays(const ByteSource& file, std::uint64_t palette, int colors, std::size_t entry) {
  const auto bytes = bytes_of(file, palette, static_cast<std::uint64_t>(colors) * entry);
  for (int i = 0; i < colors; ++i) {
    const std::byte* color = bytes.data() + static_cast<std::size_t>(i) * entry;
    const auto blue = std::to_integer<int>(color[0]), green = std::to_integer<int>(color[1]),
               red = std::to_integer<int>(color[2]);
    if (blue != i || green != i || red != i)
      refuse(file,
             fmt::format("its palette is not the ramp of grays: color {} is ({}, {}, {}), so samples are not "
                         "brightness; convert it to a gray image first",
                         i, red, green, blue));
  }
}

/// The byte after a color profile, which the largest header may name; 0 without one.
std::uint64_t end_of_profile(std::span<const std::byte> header) {
  constexpr std::uint32_t with_profile = 124;
  if (header.size() != file_header + with_profile) return 0;
  const auto size = number<std::uint32_t>(header, file_header + 116);
  return size == 0 ? 0 : std::uint64_t{file_header} + number<std::uint32_t>(header, file_header + 112) + size;
}

}  // namespace

bool begins_bmp(std::string_view bytes) {
  if (bytes.size() < file_header + 4 || !bytes.starts_with("BM")) return false;
  const auto size = load_little_endian<std::uint32_t>(reinterpret_cast<const std::byte*>(bytes.data()) + 14);
  return std::ranges::find(header_sizes, size) != header_sizes.end();
}

BmpImage bmp_image(const ByteSource& file) {
  const auto begin = bytes_of(file, 0, file_header + core_header);
  const auto header_size = number<std::uint32_t>(begin, file_header);
  if (!begins_bmp({reinterpret_cast<const char*>(begin.data()), begin.size()}))
    refuse(file, "its first bytes are not those of a bitmap");
  const auto header = bytes_of(file, 0, file_header + header_size);
  const bool is_core = header_size == core_header;
  BmpImage image;
  image.offset = number<std::uint32_t>(header, 10);
  image.width = is_core ? number<std::uint16_t>(header, 18) : number<std::int32_t>(header, 18);
  const std::int64_t rows =
      is_core ? number<std::uint16_t>(header, 20) : std::int64_t{number<std::int32_t>(header, 22)};
  image.is_top_down = rows < 0;
  image.height = image.is_top_down ? -rows : rows;
  if (image.width <= 0 || image.height <= 0)
    refuse(file, fmt::format("an image cannot have {} x {} samples", image.width, rows));
  const auto bits = number<std::uint16_t>(header, is_core ? 24 : 28);
  if (bits != 8) refuse(file, fmt::format("has {} bits a sample; only 8-bit gray images are read", bits));
  if (const auto compression = is_core ? 0 : number<std::uint32_t>(header, 30); compression != 0)
    refuse(file, fmt::format("is compressed (method {}); only uncompressed images are read", compression));
  const auto colors = is_core ? 0 : number<std::uint32_t>(header, 46);
  if (colors > 256) refuse(file, fmt::format("has a palette of {} colors for 8 bits", colors));
  if (colors != 0) image.grays = static_cast<int>(colors);
  const std::size_t entry = is_core ? 3 : 4;
  require_grays(file, file_header + header_size, image.grays, entry);
  const std::uint64_t first = file_header + header_size + static_cast<std::uint64_t>(image.grays) * entry;
  if (image.offset < first)
    refuse(file, fmt::format("its samples begin at byte {}, within its header", image.offset));
  // Both factors are below 2^31 + 3.
  const std::uint64_t bytes = image.row_bytes() * static_cast<std::uint64_t>(image.height);
  if (file.size() < image.offset || file.size() - image.offset < bytes)
    refuse(file, fmt::format("has {} bytes, but {} x {} samples should end at byte {}", file.size(),
                             image.width, image.height, image.offset + bytes));
  const std::uint64_t end = std::max(image.offset + bytes, end_of_profile(header));
  image.after = file.size() - std::min(end, file.size());
  return image;
}

void read_bmp(const ByteSource& file, const BmpImage& image, std::span<std::byte> samples) {
  const auto width = static_cast<std::size_t>(image.width);
  std::vector<std::byte> bytes(memory_size(image.row_bytes() * static_cast<std::uint64_t>(image.height)));
  file.read_at(image.offset, bytes);
  for (std::int64_t y = 0; y < image.height; ++y) {
    const std::int64_t row = image.is_top_down ? y : image.height - 1 - y;
    const auto from = std::span(bytes).subspan(static_cast<std::size_t>(row) * image.row_bytes(), width);
    const auto to = samples.subspan(static_cast<std::size_t>(y) * width, width);
    std::ranges::copy(from, to.begin());
    const int largest = std::to_integer<int>(*std::ranges::max_element(to));
    if (largest >= image.grays)
      refuse(file, fmt::format("a sample is {}, but its palette has {} colors", largest, image.grays));
  }
}

}  // namespace tagrid
