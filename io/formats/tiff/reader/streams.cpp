#include "io/formats/tiff/reader/streams.h"

#include <fmt/format.h>
#include <tiff.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <memory>
#include <new>
#include <optional>
#include <vector>

#include "io/errors/errors.h"
#include "io/files/compressed_bytes.h"

namespace tagrid {
namespace {

using Stream = std::span<const std::byte>;

constexpr std::size_t scratch_bytes = 1 << 16;

/// These functions give the bytes that a stream unpacks to, or any larger number than `most`; nothing if it is
/// damaged or has no end.
std::optional<std::uint64_t> size_of_deflate(Stream stream, std::uint64_t most) try {
  SourceStream stored(std::make_shared<BytesInMemory>(stream));
  CompressedBytes bytes(stored, Compression::zlib);
  std::vector<std::byte> scratch(scratch_bytes);
  std::uint64_t size = 0;
  for (std::size_t made = scratch.size(); made == scratch.size() && size <= most; size += made)
    made = bytes.read(scratch.data(), scratch.size());
  return size;
} catch (const BrokenInput&) {
  return std::nullopt;
}

std::optional<std::uint64_t> size_of_zstd(Stream stream, std::uint64_t most) {
  const std::unique_ptr<ZSTD_DStream, std::size_t (*)(ZSTD_DStream*)> decoder(ZSTD_createDStream(),
                                                                              ZSTD_freeDStream);
  if (!decoder) throw std::bad_alloc();
  std::vector<std::byte> scratch(ZSTD_DStreamOutSize());
  ZSTD_inBuffer in = {stream.data(), stream.size(), 0};
  std::uint64_t size = 0;
  while (size <= most) {
    ZSTD_outBuffer out = {scratch.data(), scratch.size(), 0};
    const std::size_t result = ZSTD_decompressStream(decoder.get(), &out, &in);
    size += out.pos;
    if (result == 0) return size;
    if (ZSTD_isError(result) != 0 || (in.pos == in.size && out.pos < out.size)) return std::nullopt;
  }
  return size;
}

/// Only the lengths of strings are needed. Streams without the code of their end are common.
std::optional<std::uint64_t> size_of_lzw(Stream stream, std::uint64_t most) {
  constexpr std::uint32_t clear = 256, end = 257, first_free = 258, codes = 1 << 12;
  std::array<std::uint64_t, codes> length;
  std::fill_n(length.begin(), clear, 1);
  std::uint32_t next = first_free, bits = 0;
  std::uint64_t size = 0, before = 0;  // the length of the last string
  int width = 9, left = 0;
  for (const std::byte byte : stream) {
    bits = bits << 8 | std::to_integer<std::uint32_t>(byte);
    left += 8;
    if (left < width) continue;
    left -= width;
    const std::uint32_t code = bits >> left & ((1U << width) - 1);
    if (code == end || size > most) return size;
    if (code == clear) {
      next = first_free;
      width = 9;
      before = 0;
      continue;
    }
    if (code > next || (code == next && before == 0)) return std::nullopt;
    if (before > 0 && next < codes) length[next++] = before + 1;
    if (code >= next) return std::nullopt;
    before = length[code];
    size += before;
    if (next + 1 >= 1U << width && width < 12) ++width;
  }
  return size;
}

std::optional<std::uint64_t> size_of_packbits(Stream stream, std::uint64_t most) {
  std::uint64_t size = 0;
  while (stream.size() > 1 && size <= most) {
    const int head = static_cast<std::int8_t>(stream[0]);
    constexpr int nothing = -128;
    const auto count = static_cast<std::size_t>(head < 0 ? 1 - head : 1 + head);
    const std::size_t stored = head == nothing ? 0 : head < 0 ? 1 : count;
    if (head != nothing) size += count;
    if (stored >= stream.size()) return std::nullopt;
    stream = stream.subspan(1 + stored);
  }
  return size;
}

std::optional<std::uint64_t> unpacked_size(std::uint16_t scheme, Stream stream, std::uint64_t most) {
  if (scheme == COMPRESSION_ZSTD) return size_of_zstd(stream, most);
  if (scheme == COMPRESSION_PACKBITS) return size_of_packbits(stream, most);
  return scheme == COMPRESSION_LZW ? size_of_lzw(stream, most) : size_of_deflate(stream, most);
}

/// Of programs before TIFF 6.0: codes begin at the lowest bit.
bool is_old_lzw(Stream stream) {
  return stream.size() >= 2 && stream[0] == std::byte{0} && (stream[1] & std::byte{1}) != std::byte{0};
}

}  // namespace

std::string doubt_of_stream(std::uint16_t scheme, Stream stream, std::uint64_t least, std::uint64_t most) {
  constexpr std::array known = {COMPRESSION_ADOBE_DEFLATE, COMPRESSION_DEFLATE, COMPRESSION_ZSTD,
                                COMPRESSION_LZW, COMPRESSION_PACKBITS};
  if (std::ranges::find(known, scheme) == known.end()) return "";
  if (scheme == COMPRESSION_LZW && is_old_lzw(stream)) return "";
  const auto size = unpacked_size(scheme, stream, most);
  if (!size) return "its compressed stream is damaged, or has no end";
  if (*size >= least && *size <= most) return "";
  return fmt::format("its compressed stream has {} bytes than its samples need, {}",
                     *size < least ? "fewer" : "more", least);
}

}  // namespace tagrid
