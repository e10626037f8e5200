#include "io/formats/tiff/reader/pieces.h"

#include <fmt/format.h>
#include <tiff.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <new>
#include <optional>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/bytes/memory_size.h"
#include "io/errors/errors.h"
#include "io/files/compressed_bytes.h"
#include "io/formats/tiff/reader/directories.h"
#include "io/formats/tiff/reader/libtiff.h"
#include "io/formats/tiff/reader/tiff_file.h"

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

namespace {

/// Few volumes have numbers of other magnitudes, but every second float has one once its bytes are
/// swapped.
bool is_unusual(double value) {
  const double size = std::abs(value);
  return std::isfinite(value) && size != 0 && (size < 1e-20 || size > 1e20);
}

template <class Float, class Bits>
FloatOrder float_order_of(std::span<const std::byte> samples) {
  std::uint64_t here = 0, swapped = 0;
  for (std::size_t at = 0; at + sizeof(Float) <= samples.size(); at += sizeof(Float)) {
    const auto bits = load_little_endian<Bits>(samples.data() + at);
    here += is_unusual(std::bit_cast<Float>(bits));
    swapped += is_unusual(std::bit_cast<Float>(byte_swapped(bits)));
  }
  // In the right order, some numbers may be unusual; in both orders, all may be.
  constexpr std::uint64_t clearly = 4;
  if (here == 0 || swapped > clearly * here) return FloatOrder::usual;
  return here > clearly * swapped ? FloatOrder::swapped : FloatOrder::unclear;
}

}  // namespace

FloatOrder float_order_of(std::span<const std::byte> samples, SampleType type) {
  return type == SampleType::float32 ? float_order_of<float, std::uint32_t>(samples)
                                     : float_order_of<double, std::uint64_t>(samples);
}

// The strips and tiles of a page: where they lie, and their samples.

namespace {

/// Unpacks unsigned integers of `bits` bits, which follow each other with the highest bit first: to bytes if
/// bits < 8, otherwise to 16-bit integers in the byte order of memory. REQUIRES: 1 <= bits <= 15; `packed`
/// has (count * bits + 7) / 8 bytes, `samples` has room for `count`.
void unpack(const std::byte* packed, int bits, std::size_t count, std::byte* samples) {
  assert(1 <= bits && bits <= 15);
  std::uint32_t window = 0;  // bytes that were taken, of which the last `left` bits are still to come
  int left = 0;
  for (std::size_t i = 0; i < count; ++i) {
    for (; left < bits; left += 8) window = window << 8 | std::to_integer<std::uint32_t>(*packed++);
    left -= bits;
    const auto sample = static_cast<std::uint16_t>(window >> left & ((1U << bits) - 1));
    if (bits < 8)
      samples[i] = static_cast<std::byte>(sample);
    else
      std::memcpy(samples + 2 * i, &sample, sizeof sample);
  }
}

/// The samples of a strip or tile that was never written.
void fill(std::byte* out, std::size_t count, const TiffPage& page) {
  with_sample_type(page.type, [&](auto sample) {
    sample = static_cast<decltype(sample)>(page.fill);
    for (std::size_t i = 0; i < count; ++i) std::memcpy(out + i * sizeof sample, &sample, sizeof sample);
  });
}

}  // namespace

bool TiffFile::is_unwritten(std::uint32_t piece) const {
  return TIFFGetStrileOffset(tiff_.get(), piece) == 0 && TIFFGetStrileByteCount(tiff_.get(), piece) == 0;
}

/// A strip or tile without a place and without bytes was never written (GDAL calls such files sparse). One
/// that has only one of them is broken; and without compression, one needs as many bytes as its samples.
void TiffFile::check_pieces(TiffPage& page) const {
  TIFF* tiff = tiff_.get();
  const bool is_tiled = TIFFIsTiled(tiff) != 0;
  const bool is_plain =
      value_of<std::uint16_t>(tiff, TIFFTAG_COMPRESSION, COMPRESSION_NONE) == COMPRESSION_NONE;
  const auto whole = static_cast<std::uint64_t>(is_tiled ? TIFFTileSize64(tiff) : TIFFStripSize64(tiff));
  const char* name = is_tiled ? "tile" : "strip";
  page.pieces = is_tiled ? TIFFNumberOfTiles(tiff) : TIFFNumberOfStrips(tiff);
  const std::vector<std::uint64_t> stored = replaced_counts(page);
  std::uint64_t left = page.row_in_file() * page.height;
  for (std::uint32_t piece = 0; piece < page.pieces; ++piece) {
    const std::uint64_t place = TIFFGetStrileOffset(tiff, piece),
                        bytes = stored.empty() ? TIFFGetStrileByteCount(tiff, piece) : stored[piece];
    const std::uint64_t wanted = is_tiled ? whole : std::min(left, whole);
    left -= std::min(left, wanted);
    if (place == 0 && bytes == 0) {
      ++page.unwritten;
      continue;
    }
    constexpr std::uint64_t header = 8;
    if (place < header || bytes == 0)
      fail(fmt::format("{} {} begins at byte {} and has {} bytes, so its samples are not known", name,
                       piece + 1, place, bytes));
    if (is_plain && bytes < wanted)
      fail(fmt::format("{} {} has {} bytes, but its samples need {}", name, piece + 1, bytes, wanted));
  }
  if (page.unwritten > 0) require_all_places(page);
}

/// The bytes of each strip as the file has them, if libtiff has calculated others; empty if it has not, or if
/// there is only one.
std::vector<std::uint64_t> TiffFile::replaced_counts(const TiffPage& page) const {
  if (of_tags.warnings.empty() || page.pieces < 2) return {};
  try {
    const TiffDirectories file(path_);
    for (const TiffField& field : file.at(page.directory).fields)
      if (field.tag == TIFFTAG_STRIPBYTECOUNTS && field.count == page.pieces) return file.numbers(field);
  } catch (const NoPlainForm&) {
  }
  return {};
}

/// libtiff takes places that are not listed for zeros.
void TiffFile::require_all_places(const TiffPage& page) const {
  constexpr std::array<std::uint16_t, 4> tags = {TIFFTAG_STRIPOFFSETS, TIFFTAG_STRIPBYTECOUNTS,
                                                 TIFFTAG_TILEOFFSETS, TIFFTAG_TILEBYTECOUNTS};
  try {
    for (const TiffField& field : TiffDirectories(path_).at(page.directory).fields)
      if (std::ranges::find(tags, field.tag) != tags.end() && field.count < page.pieces)
        fail(fmt::format("an image has {} strips or tiles, but tag {} has {} numbers", page.pieces, field.tag,
                         field.count));
  } catch (const NoPlainForm& broken) {
    fail(broken.why);
  }
}

std::optional<std::uint64_t> TiffFile::plain_place(const TiffPage& page) const {
  TIFF* tiff = tiff_.get();
  if (page.packed_bits != 0 || page.unwritten > 0 ||
      value_of<std::uint16_t>(tiff, TIFFTAG_COMPRESSION, COMPRESSION_NONE) != COMPRESSION_NONE ||
      TIFFIsTiled(tiff) != 0 ||
      value_of<std::uint16_t>(tiff, TIFFTAG_FILLORDER, FILLORDER_MSB2LSB) != FILLORDER_MSB2LSB)
    return std::nullopt;
  const std::uint32_t strips = TIFFNumberOfStrips(tiff);
  if (strips == 0) return std::nullopt;
  const std::uint64_t begin = TIFFGetStrileOffset(tiff, 0);
  std::uint64_t next = begin, left = page.bytes();
  for (std::uint32_t strip = 0; strip < strips; ++strip) {
    const std::uint64_t wanted =
        std::min<std::uint64_t>(left, static_cast<std::uint64_t>(TIFFStripSize64(tiff)));
    // The last strip may be longer than its samples.
    if (TIFFGetStrileOffset(tiff, strip) != next || TIFFGetStrileByteCount(tiff, strip) < wanted ||
        (TIFFGetStrileByteCount(tiff, strip) != wanted && left != wanted))
      return std::nullopt;
    next += wanted;
    left -= wanted;
  }
  if (left > 0 || next > size_) return std::nullopt;
  // Samples that may have an error must not be what the file is read by.
  constexpr std::uint64_t header = 8;
  if (begin < header || (page.directory >= begin && page.directory < next)) return std::nullopt;
  return begin;
}

void TiffFile::read(const TiffPage& page, std::byte* out) {
  last_reason.clear();
  if (TIFFCurrentDirOffset(tiff_.get()) != page.directory &&
      TIFFSetSubDirectory(tiff_.get(), page.directory) != 1)
    fail(last_reason);
  last_warning.clear();
  if (TIFFIsTiled(tiff_.get()) != 0)
    read_tiles(page, out);
  else
    read_strips(page, out);
  // libtiff fills what is missing of a JPEG stream, or of a line of a fax, and only warns.
  if (!last_warning.empty()) fail("its samples are damaged: " + last_warning);
  // libtiff reads what the standard states, but writes something else.
  if (!page.may_be_swapped) return;
  const FloatOrder order = float_order_of({out, page.bytes()}, page.type);
  if (order == FloatOrder::swapped)
    fail(
        "the bytes of its samples are swapped: it was written with a bug of libtiff 4.5 that swaps them in "
        "big-endian files with a predictor of floats (Predictor 3); write it again, without that predictor "
        "or little-endian");
  if (order == FloatOrder::unclear)
    remarks_.miss(
        "the bytes of its samples may be swapped by a bug of libtiff 4.5 in big-endian files with a "
        "predictor of floats (Predictor 3): in both byte orders, many of its numbers are very large or very "
        "small; they are read as the standard states; check the values");
}

/// Fails because a strip or tile cannot be read.
void TiffFile::fail_in(std::uint32_t piece) const {
  const std::uint64_t begin = TIFFGetStrileOffset(tiff_.get(), piece),
                      bytes = TIFFGetStrileByteCount(tiff_.get(), piece),
                      left = size_ - std::min(begin, size_);
  if (bytes > left)
    fail(fmt::format("ends too soon, within its samples: {} of {} bytes are missing", bytes - left, bytes));
  fail(last_reason.empty() ? "its samples end too soon" : last_reason);
}

/// Checks the stream of a strip or tile, of which from `least` to `most` bytes are expected.
void TiffFile::check_stream(std::uint32_t piece, std::uint64_t least, std::uint64_t most) {
  TIFF* tiff = tiff_.get();
  const auto scheme = value_of<std::uint16_t>(tiff, TIFFTAG_COMPRESSION, COMPRESSION_NONE);
  if (scheme == COMPRESSION_NONE) return;
  const bool is_tiled = TIFFIsTiled(tiff) != 0;
  stream_.resize(memory_size(std::min(TIFFGetStrileByteCount(tiff, piece), size_)));
  const auto size = static_cast<tmsize_t>(stream_.size());
  if ((is_tiled ? TIFFReadRawTile : TIFFReadRawStrip)(tiff, piece, stream_.data(), size) != size)
    fail_in(piece);
  if (value_of<std::uint16_t>(tiff, TIFFTAG_FILLORDER, FILLORDER_MSB2LSB) == FILLORDER_LSB2MSB)
    TIFFReverseBits(reinterpret_cast<std::uint8_t*>(stream_.data()), size);
  if (const std::string doubt = doubt_of_stream(scheme, stream_, least, most); !doubt.empty())
    fail(fmt::format("{} {} of an image cannot be read: {}", is_tiled ? "tile" : "strip", piece + 1, doubt));
}

void TiffFile::read_strips(const TiffPage& page, std::byte* out) {
  TIFF* tiff = tiff_.get();
  const std::uint32_t strips = TIFFNumberOfStrips(tiff);
  const std::uint64_t row = page.row_in_file();
  std::vector<std::byte> packed(page.packed_bits != 0 ? memory_size(TIFFStripSize64(tiff)) : 0);
  std::uint64_t left = row * page.height;
  for (std::uint32_t strip = 0; strip < strips && left > 0; ++strip) {
    const std::uint64_t wanted =
        std::min<std::uint64_t>(left, static_cast<std::uint64_t>(TIFFStripSize64(tiff)));
    if (is_unwritten(strip)) {
      const std::size_t count = wanted / row * page.width;
      if (wanted % row != 0) fail("its strips do not hold whole rows");
      fill(out, count, page);
      out += count * size_of(page.type);
      left -= wanted;
      continue;
    }
    // The last one may have rows below the image.
    check_stream(strip, wanted, static_cast<std::uint64_t>(TIFFStripSize64(tiff)));
    if (TIFFReadEncodedStrip(tiff, strip, packed.empty() ? out : packed.data(),
                             static_cast<tmsize_t>(wanted)) != static_cast<tmsize_t>(wanted))
      fail_in(strip);
    if (packed.empty()) {
      out += wanted;
    } else {
      if (wanted % row != 0) fail("its strips do not hold whole rows");
      for (std::uint64_t at = 0; at < wanted; at += row, out += page.width * size_of(page.type))
        unpack(packed.data() + at, page.packed_bits, page.width, out);
    }
    left -= wanted;
  }
  if (left > 0) fail("its samples end too soon");
}

void TiffFile::read_tiles(const TiffPage& page, std::byte* out) {
  TIFF* tiff = tiff_.get();
  const auto width = value_of<std::uint32_t>(tiff, TIFFTAG_TILEWIDTH, 0),
             height = value_of<std::uint32_t>(tiff, TIFFTAG_TILELENGTH, 0);
  const std::size_t sample = size_of(page.type), row = std::size_t{page.width} * sample;
  const std::uint64_t tile_row =
      page.packed_bits == 0 ? std::uint64_t{width} * sample
                            : (std::uint64_t{width} * static_cast<std::uint64_t>(page.packed_bits) + 7) / 8;
  if (width == 0 || height == 0 || TIFFTileSize64(tiff) != tile_row * height) fail("its tiles have no size");
  std::vector<std::byte> tile(memory_size(TIFFTileSize64(tiff)));
  for (std::uint32_t y = 0; y < page.height; y += std::min(height, page.height - y))
    for (std::uint32_t x = 0; x < page.width; x += std::min(width, page.width - x)) {
      const std::uint32_t number = TIFFComputeTile(tiff, x, y, 0, 0);
      const auto size = static_cast<tmsize_t>(tile.size());
      const bool is_there = !is_unwritten(number);
      if (is_there) check_stream(number, tile.size(), tile.size());
      if (is_there && TIFFReadEncodedTile(tiff, number, tile.data(), size) != size) fail_in(number);
      const std::size_t columns = std::min(width, page.width - x);
      for (std::uint32_t i = 0; i < std::min(height, page.height - y); ++i) {
        std::byte* to = out + (std::size_t{y} + i) * row + x * sample;
        const std::byte* from = tile.data() + i * tile_row;
        if (!is_there)
          fill(to, columns, page);
        else if (page.packed_bits == 0)
          std::memcpy(to, from, columns * sample);
        else
          unpack(from, page.packed_bits, columns, to);
      }
    }
}

std::uint64_t TiffFile::memory_for_page() const {
  TIFF* tiff = tiff_.get();
  // libtiff keeps the compressed bytes, which are checked in another copy, and those of which a predictor
  // makes samples; a tile is copied from.
  const bool is_tiled = TIFFIsTiled(tiff) != 0;
  const std::uint32_t count = is_tiled ? TIFFNumberOfTiles(tiff) : TIFFNumberOfStrips(tiff);
  std::uint64_t compressed = 0;
  for (std::uint32_t i = 0; i < count; ++i)
    compressed = std::max<std::uint64_t>(compressed, TIFFGetStrileByteCount(tiff, i));
  const std::uint64_t samples = is_tiled ? TIFFTileSize64(tiff) : TIFFStripSize64(tiff);
  return 3 * std::min(compressed, size_) + (std::uint64_t{1} << 20) + 2 * samples + 16 * std::uint64_t{count};
}

}  // namespace tagrid
