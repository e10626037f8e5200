#include "tools/readers/tiff/tiff_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <limits>
#include <string_view>

#include "io/files/errors.h"
#include "tools/readers/tiff/packed_samples.h"

namespace tagrid {
namespace {

/// libtiff gives its reasons to a function.
std::string last_reason, last_warning;

std::string text_of(const char* format, va_list values) {
  std::array<char, 500> text = {};
  std::vsnprintf(text.data(), text.size(), format, values);
  return text.data();
}

void keep_reason(const char* /*where*/, const char* format, va_list values) {
  last_reason = text_of(format, values);
}

/// Of warnings while samples are read, those that speak of how they are stored, not of what is missing.
bool is_harmless(std::string_view warning) {
  return warning.starts_with("Old-style LZW codes") ||
         warning.starts_with("JPEG strip size exceeds expected dimensions");
}

void keep_warning(const char* /*where*/, const char* format, va_list values) {
  const std::string warning = text_of(format, values);
  if (!is_harmless(warning)) last_warning = warning;
}

template <class T>
T value_of(TIFF* tiff, std::uint32_t tag, T otherwise) {
  T value = otherwise;
  return TIFFGetFieldDefaulted(tiff, tag, &value) == 1 ? value : otherwise;
}

std::string name_of_compression(std::uint16_t scheme) {
  switch (scheme) {
    case COMPRESSION_OJPEG:
      return "the JPEG of old TIFF files";
    case COMPRESSION_LERC:
      return "LERC";
    case COMPRESSION_WEBP:
      return "WebP";
    case COMPRESSION_JXL:
      return "JPEG XL";
    case 33003:
    case 33005:
    case COMPRESSION_JP2000:
      return "JPEG 2000";
    default:
      return fmt::format("scheme {}", scheme);
  }
}

/// How the samples of a page are stored, for users.
std::string name_of_storage(TIFF* tiff, int packed_bits) {
  const auto scheme = value_of<std::uint16_t>(tiff, TIFFTAG_COMPRESSION, COMPRESSION_NONE);
  switch (scheme) {
    case COMPRESSION_NONE:
      if (packed_bits != 0) return fmt::format("packed samples of {} bits", packed_bits);
      return TIFFIsTiled(tiff) != 0 ? "tiles" : "scattered strips";
    case COMPRESSION_LZW:
      return "LZW";
    case COMPRESSION_ADOBE_DEFLATE:
    case COMPRESSION_DEFLATE:
      return "deflate";
    case COMPRESSION_PACKBITS:
      return "PackBits";
    case COMPRESSION_LZMA:
      return "LZMA";
    case COMPRESSION_ZSTD:
      return "zstd";
    case COMPRESSION_JPEG:
      return "JPEG";
    default:
      return "CCITT fax";
  }
}

/// Whether decoding gives the numbers that were stored.
bool is_lossless(std::uint16_t scheme) {
  constexpr std::array schemes = {COMPRESSION_NONE,      COMPRESSION_LZW,      COMPRESSION_ADOBE_DEFLATE,
                                  COMPRESSION_DEFLATE,   COMPRESSION_PACKBITS, COMPRESSION_LZMA,
                                  COMPRESSION_ZSTD,      COMPRESSION_CCITTRLE, COMPRESSION_CCITTRLEW,
                                  COMPRESSION_CCITTFAX3, COMPRESSION_CCITTFAX4};
  return std::ranges::find(schemes, scheme) != schemes.end();
}

/// True if a file has the magic of TIFF or BigTIFF, in either byte order.
bool begins_tiff(const std::string& path) {
  std::array<char, 4> magic = {};
  std::ifstream(path, std::ios::binary).read(magic.data(), magic.size());
  const std::string_view begin(magic.data(), magic.size());
  const auto is_version = [](char c) { return c == 42 || c == 43; };
  return begin.starts_with("II") ? is_version(begin[2]) && begin[3] == 0
                                 : begin.starts_with("MM") && begin[2] == 0 && is_version(begin[3]);
}

}  // namespace

TiffFile::TiffFile(const std::string& path) : path_(path) {
  TIFFSetErrorHandler(keep_reason);
  TIFFSetWarningHandler(keep_warning);  // mostly of tags that it does not know
  last_reason.clear();
  const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) throw world_error("cannot open", path, errno);
  struct stat status = {};
  const bool is_file = fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode);
  // m: without mapping the file, whose damage would end the program
  if (is_file) tiff_.reset(TIFFFdOpen(descriptor, path.c_str(), "rm"));
  if (!tiff_) {
    close(descriptor);
    if (!is_file) throw BrokenInput(path + ": is not a regular file");
    if (!begins_tiff(path)) throw BrokenInput(path + ": is not a TIFF file");
    fail(fmt::format("ends too soon, or is damaged ({})", last_reason));
  }
  size_ = static_cast<std::uint64_t>(status.st_size);
}

void TiffFile::fail(const std::string& why) const {
  throw BrokenInput(fmt::format("{}: TIFF file: {}", path_, why.empty() ? "cannot be read" : why));
}

std::vector<TiffPage> TiffFile::pages() {
  std::vector<TiffPage> pages;
  do {
    // Small images for previews are no slices.
    constexpr std::uint32_t not_full = FILETYPE_REDUCEDIMAGE | FILETYPE_MASK;
    const bool is_slice = (value_of<std::uint32_t>(tiff_.get(), TIFFTAG_SUBFILETYPE, 0) & not_full) == 0;
    if (is_slice) pages.push_back(current_page());
    last_reason.clear();
  } while (TIFFReadDirectory(tiff_.get()) == 1);
  if (!last_reason.empty()) fail(fmt::format("ends too soon, or is damaged ({})", last_reason));
  if (pages.empty()) fail("has no image");
  return pages;
}

TiffPage TiffFile::current_page() {
  TIFF* tiff = tiff_.get();
  TiffPage page;
  page.directory = TIFFCurrentDirOffset(tiff);
  page.width = value_of<std::uint32_t>(tiff, TIFFTAG_IMAGEWIDTH, 0);
  page.height = value_of<std::uint32_t>(tiff, TIFFTAG_IMAGELENGTH, 0);
  require_readable(page);
  const auto [type, packed_bits] = kind_of_samples();
  page.type = type;
  page.packed_bits = packed_bits;
  page.is_lossy = !is_lossless(value_of<std::uint16_t>(tiff, TIFFTAG_COMPRESSION, COMPRESSION_NONE));
  page.storage = name_of_storage(tiff, packed_bits);
  page.zero_is_white =
      value_of<std::uint16_t>(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK) == PHOTOMETRIC_MINISWHITE;
  page.orientation = value_of<std::uint16_t>(tiff, TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT);
  const char* description = nullptr;
  if (TIFFGetField(tiff, TIFFTAG_IMAGEDESCRIPTION, &description) == 1 && description != nullptr)
    page.description = description;
  page.x_resolution = value_of<float>(tiff, TIFFTAG_XRESOLUTION, 0);
  page.y_resolution = value_of<float>(tiff, TIFFTAG_YRESOLUTION, 0);
  page.plain = plain_place(page);
  page.big_endian = TIFFIsBigEndian(tiff) != 0;
  page.memory = memory_for_page();
  return page;
}

void TiffFile::require_readable(const TiffPage& page) const {
  TIFF* tiff = tiff_.get();
  if (page.width == 0 || page.height == 0) fail("an image without width or height");
  constexpr std::uint32_t most = std::numeric_limits<std::int32_t>::max();
  if (page.width > most || page.height > most)
    fail(fmt::format("an image of {} x {} pixels is too large", page.width, page.height));
  const auto colors = value_of<std::uint16_t>(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
  const auto meaning = value_of<std::uint16_t>(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  if (colors != 1 || (meaning != PHOTOMETRIC_MINISBLACK && meaning != PHOTOMETRIC_MINISWHITE))
    fail(
        "its pixels are colours, not single numbers; convert it to greyscale first, in the program that "
        "knows what the colours "
        "mean");
  const auto scheme = value_of<std::uint16_t>(tiff, TIFFTAG_COMPRESSION, COMPRESSION_NONE);
  if (!is_lossless(scheme) && scheme != COMPRESSION_JPEG)
    fail(fmt::format(
        "is compressed by {}, which is not read; save it uncompressed, or by deflate, LZW or zstd",
        name_of_compression(scheme)));
  if (TIFFIsCODECConfigured(scheme) == 0)
    fail(fmt::format("scheme {} of compression is missing in libtiff", scheme));
  if (value_of<std::uint32_t>(tiff, TIFFTAG_IMAGEDEPTH, 1) != 1)
    fail("an image of several slices (ImageDepth) is not read");
}

TiffFile::Samples TiffFile::kind_of_samples() const {
  const auto bits = value_of<std::uint16_t>(tiff_.get(), TIFFTAG_BITSPERSAMPLE, 1);
  const auto format = value_of<std::uint16_t>(tiff_.get(), TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT);
  const bool is_unsigned = format == SAMPLEFORMAT_UINT || format == SAMPLEFORMAT_VOID;
  if (is_unsigned && bits == 8) return {SampleType::uint8};
  if (is_unsigned && bits == 16) return {SampleType::uint16};
  if (is_unsigned && bits == 32) return {SampleType::uint32};
  if (is_unsigned && bits >= 1 && bits <= 15)
    return {bits < 8 ? SampleType::uint8 : SampleType::uint16, static_cast<int>(bits)};
  if (format == SAMPLEFORMAT_INT && bits == 8) return {SampleType::int8};
  if (format == SAMPLEFORMAT_INT && bits == 16) return {SampleType::int16};
  if (format == SAMPLEFORMAT_INT && bits == 32) return {SampleType::int32};
  if (format == SAMPLEFORMAT_IEEEFP && bits == 32) return {SampleType::float32};
  if (format == SAMPLEFORMAT_IEEEFP && bits == 64) return {SampleType::float64};
  const char* kind = is_unsigned                     ? "unsigned integers"
                     : format == SAMPLEFORMAT_INT    ? "integers"
                     : format == SAMPLEFORMAT_IEEEFP ? "floats"
                                                     : "complex numbers";
  fail(
      fmt::format("samples are {} of {} bits; integers of 8, 16 and 32 bits, unsigned ones of 1 to 15, and "
                  "floats of 32 and 64 can be "
                  "read",
                  kind, bits));
}

std::optional<std::uint64_t> TiffFile::plain_place(const TiffPage& page) const {
  TIFF* tiff = tiff_.get();
  if (page.packed_bits != 0 ||
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
}

void TiffFile::read_strips(const TiffPage& page, std::byte* out) {
  TIFF* tiff = tiff_.get();
  const std::uint32_t strips = TIFFNumberOfStrips(tiff);
  const std::uint64_t row = page.row_in_file();
  std::vector<std::byte> packed(page.packed_bits != 0 ? TIFFStripSize64(tiff) : 0);
  std::uint64_t left = row * page.height;
  for (std::uint32_t strip = 0; strip < strips && left > 0; ++strip) {
    const std::uint64_t wanted =
        std::min<std::uint64_t>(left, static_cast<std::uint64_t>(TIFFStripSize64(tiff)));
    if (TIFFReadEncodedStrip(tiff, strip, packed.empty() ? out : packed.data(),
                             static_cast<tmsize_t>(wanted)) != static_cast<tmsize_t>(wanted))
      fail(last_reason.empty() ? "its samples end too soon" : last_reason);
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
  std::vector<std::byte> tile(TIFFTileSize64(tiff));
  for (std::uint32_t y = 0; y < page.height; y += std::min(height, page.height - y))
    for (std::uint32_t x = 0; x < page.width; x += std::min(width, page.width - x)) {
      const std::uint32_t number = TIFFComputeTile(tiff, x, y, 0, 0);
      const auto size = static_cast<tmsize_t>(tile.size());
      if (TIFFReadEncodedTile(tiff, number, tile.data(), size) != size)
        fail(last_reason.empty() ? "its samples end too soon" : last_reason);
      const std::size_t columns = std::min(width, page.width - x);
      for (std::uint32_t i = 0; i < std::min(height, page.height - y); ++i) {
        std::byte* to = out + (std::size_t{y} + i) * row + x * sample;
        const std::byte* from = tile.data() + i * tile_row;
        if (page.packed_bits == 0)
          std::memcpy(to, from, columns * sample);
        else
          unpack(from, page.packed_bits, columns, to);
      }
    }
}

std::uint64_t TiffFile::memory_for_page() const {
  TIFF* tiff = tiff_.get();
  // libtiff keeps the compressed bytes, and those of which a predictor makes samples; a tile is copied from.
  const bool is_tiled = TIFFIsTiled(tiff) != 0;
  const std::uint32_t count = is_tiled ? TIFFNumberOfTiles(tiff) : TIFFNumberOfStrips(tiff);
  std::uint64_t compressed = 0;
  for (std::uint32_t i = 0; i < count; ++i)
    compressed = std::max<std::uint64_t>(compressed, TIFFGetStrileByteCount(tiff, i));
  const std::uint64_t samples = is_tiled ? TIFFTileSize64(tiff) : TIFFStripSize64(tiff);
  return 2 * std::min(compressed, size_) + 2 * samples + 16 * std::uint64_t{count};
}

}  // namespace tagrid
