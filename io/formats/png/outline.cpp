#include "io/formats/png/outline.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"

namespace tagrid {
namespace {

using namespace std::string_view_literals;

constexpr std::string_view signature = "\x89PNG\r\n\x1a\n";
constexpr std::size_t header_bytes = 13, bits_at = 24, color_at = 25;
constexpr std::uint64_t chunk_head = 8, chunk_crc = 4;

[[noreturn]] void refuse(const ByteSource& file, std::string_view why) {
  throw BrokenInput("{}: PNG file: {}", file.name(), why);
}

std::uint32_t number_at(std::string_view bytes, std::size_t at) {
  return byte_swapped(
      load_little_endian<std::uint32_t>(reinterpret_cast<const std::byte*>(bytes.data()) + at));
}

/// A chunk: its name, and where its content is.
struct Chunk {
  std::array<char, 4> letters = {};
  std::uint64_t begin = 0, length = 0;

  std::string_view name() const { return {letters.data(), letters.size()}; }
};

Chunk chunk_at(const ByteSource& file, std::uint64_t at) {
  std::array<char, chunk_head> head;
  if (file.size() < at || file.size() - at < chunk_head)
    refuse(file, "is truncated: its last chunk is missing");
  file.read_at(at, std::as_writable_bytes(std::span(head)));
  const std::string_view text(head.data(), head.size());
  Chunk chunk{{}, at + chunk_head, number_at(text, 0)};
  text.copy(chunk.letters.data(), 4, 4);
  if (file.size() - chunk.begin < chunk.length + chunk_crc)
    refuse(file, fmt::format("is truncated: the chunk at byte {} should have {} bytes", at, chunk.length));
  return chunk;
}

/// The first bytes of a chunk; zeros for those that it does not have.
template <std::size_t size>
std::array<char, size> content(const ByteSource& file, const Chunk& chunk) {
  std::array<char, size> bytes = {};
  file.read_at(chunk.begin,
               std::as_writable_bytes(std::span(bytes))
                   .first(static_cast<std::size_t>(std::min<std::uint64_t>(size, chunk.length))));
  return bytes;
}

PngOutline read_header(const ByteSource& file) {
  std::array<char, signature.size() + chunk_head + header_bytes> bytes;
  if (file.size() < bytes.size()) refuse(file, "ends within its header");
  file.read_at(0, std::as_writable_bytes(std::span(bytes)));
  const std::string_view text(bytes.data(), bytes.size());
  if (!text.starts_with(signature) || number_at(text, 8) != header_bytes || text.substr(12, 4) != "IHDR")
    refuse(file, "its first bytes are not those of a PNG image");
  constexpr std::array kinds = {
      "gray"sv, ""sv, "RGB"sv, "palette"sv, "gray and transparency"sv, ""sv, "RGB and transparency"sv};
  const auto color = static_cast<unsigned char>(text[color_at]),
             bits = static_cast<unsigned char>(text[bits_at]);
  if (color >= kinds.size() || kinds[color].empty())
    refuse(file, fmt::format("its color type {} is not known", color));
  if (color != 0)
    refuse(file, fmt::format(
                     "its samples are colors ({}), not single numbers; convert it to a gray image first, in "
                     "the program that knows what the colors mean",
                     kinds[color]));
  if (!begins_gray_png(text))
    refuse(file, fmt::format("has samples of {} bits; those of 8 and 16 are read", bits));
  PngOutline outline;
  outline.bits = bits;
  outline.width = std::int64_t{number_at(text, 16)};
  outline.height = std::int64_t{number_at(text, 20)};
  constexpr std::int64_t most = std::int64_t{1} << 31;
  if (outline.width < 1 || outline.height < 1 || outline.width >= most || outline.height >= most)
    refuse(file, fmt::format("an image cannot have {} x {} samples", outline.width, outline.height));
  return outline;
}

/// Samples per meter; a resolution without a unit tells only how wide a sample is for its height.
void read_resolution(const ByteSource& file, const Chunk& chunk, PngOutline& outline) {
  const auto bytes = content<9>(file, chunk);
  const std::string_view text(bytes.data(), bytes.size());
  constexpr char of_meter = 1;
  if (text[8] != of_meter) return;
  outline.x_per_meter = number_at(text, 0);
  outline.y_per_meter = number_at(text, 4);
}

}  // namespace

bool begins_gray_png(std::string_view bytes) {
  return bytes.size() >= png_header_bytes && bytes.starts_with(signature) && bytes[color_at] == 0 &&
         (bytes[bits_at] == 8 || bytes[bits_at] == 16);
}

PngOutline png_outline(const ByteSource& file) {
  PngOutline outline = read_header(file);
  // Programs write samples in chunks of some kilobytes, and few others. Each chunk takes time.
  constexpr std::uint64_t most_small = 10'000, usual_bytes = 1024;
  const std::uint64_t most_chunks = most_small + file.size() / usual_bytes;
  std::uint64_t compressed = 0;  // bytes
  std::uint64_t chunks = 0;
  for (std::uint64_t at = signature.size();;) {
    if (++chunks > most_chunks)
      refuse(file, fmt::format("has more than {} chunks, which is too many for its size; write it anew with "
                               "another program",
                               most_chunks));
    const Chunk chunk = chunk_at(file, at);
    at = chunk.begin + chunk.length + chunk_crc;
    if (chunk.name() == "IDAT") compressed += chunk.length;
    if (chunk.name() == "pHYs") read_resolution(file, chunk, outline);
    if (chunk.name() == "tRNS") outline.has_transparent = true;
    if (chunk.name() == "acTL") outline.has_more_images = true;
    if (chunk.name() != "IEND") continue;
    outline.after = file.size() - at;
    break;
  }
  // Deflate makes at most so many bytes of one.
  constexpr std::uint64_t most_ratio = 1032;
  const std::uint64_t pixels =
      static_cast<std::uint64_t>(outline.width) * static_cast<std::uint64_t>(outline.height);
  if (pixels / most_ratio * static_cast<std::uint64_t>(outline.bits / 8) > compressed)
    refuse(file, fmt::format("has {} bytes of samples, which cannot be those of {} x {}; it may be truncated",
                             compressed, outline.width, outline.height));
  return outline;
}

}  // namespace tagrid
