#include "io/formats/dicom/reader/code_streams.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstdint>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"

namespace tagrid {
namespace {

/// The number of bytes in a segment of RLE when it is unpacked; those below `count` become the bytes at
/// `out`, `step` bytes apart. Zeros that fill up the segment do not count.
std::size_t unpack(std::span<const std::byte> segment, std::size_t count, std::size_t step, std::byte* out) {
  std::size_t done = 0;
  const auto put = [&](std::byte byte) {
    if (done < count) out[done * step] = byte;
    ++done;
  };
  const auto is_zero = [](std::byte byte) { return byte == std::byte{0}; };
  for (std::size_t i = 0; i < segment.size();) {
    if (done == count && std::ranges::all_of(segment.subspan(i), is_zero)) break;
    const auto control = static_cast<int>(static_cast<std::int8_t>(segment[i++]));
    if (control >= 0) {
      for (int n = 0; n <= control && i < segment.size(); ++n) put(segment[i++]);
    } else if (control != -128 && i < segment.size()) {
      for (int n = 0; n <= -control; ++n) put(segment[i]);
      ++i;
    }
  }
  return done;
}

}  // namespace

std::optional<JpegFrame> jpeg_frame(std::span<const std::byte> beginning) {
  const auto at = [&](std::size_t i) { return std::to_integer<int>(beginning[i]); };
  const auto number = [&](std::size_t i) { return at(i) << 8 | at(i + 1); };
  for (std::size_t i = 2; i + 10 <= beginning.size() && at(i) == 0xFF;) {
    const int marker = at(i + 1);
    if (marker == 0xFF) {  // a marker may have more of these in front
      ++i;
      continue;
    }
    // C4, C8 and CC are other segments among the frame headers.
    if (marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC)
      return JpegFrame{at(i + 4), number(i + 5), number(i + 7), at(i + 9)};
    i += 2 + static_cast<std::size_t>(number(i + 2));
  }
  return std::nullopt;
}

void decode_rle(std::span<const std::byte> stream, std::size_t size, std::size_t count, std::byte* out) {
  constexpr std::size_t head = 64;
  const auto number = [&](std::size_t i) { return load_little_endian<std::uint32_t>(stream.data() + 4 * i); };
  if (stream.size() < head) throw BrokenInput("the RLE stream ends too soon");
  if (number(0) != size)
    throw BrokenInput(
        fmt::format("the RLE stream has samples of {} bytes, but {} are expected", number(0), size));
  for (std::size_t i = 0; i < size; ++i) {
    const std::size_t begin = number(1 + i), end = i + 1 < size ? number(2 + i) : stream.size();
    if (begin < head || begin > end || end > stream.size())
      throw BrokenInput("the RLE stream is broken: its segments cannot be found");
    const std::size_t byte = std::endian::native == std::endian::little ? size - 1 - i : i;
    const std::size_t found = unpack(stream.subspan(begin, end - begin), count, size, out + byte);
    constexpr std::size_t padding = 3;  // bytes that fill up a segment may look like a few samples
    if (found < count || found - count > padding)
      throw BrokenInput(
          fmt::format("the RLE stream has {} bytes in segment {}, but {} are expected", found, i + 1, count));
  }
}

}  // namespace tagrid
