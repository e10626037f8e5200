#include "tools/formats/tiff/libtiff.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstdio>
#include <string_view>

namespace tagrid {
namespace {

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
  if (warning.find("calculating from imagelength") != warning.npos)
    of_tags.warn(
        "its StripByteCounts are absent, or not what its samples need; samples are read from where "
        "they begin");
  else if (warning.find("ignor") != warning.npos)
    of_tags.miss("a tag of it cannot be read (" + warning + ")");
}

}  // namespace

std::string last_reason, last_warning;
TiffRemarks of_tags;

void listen_to_libtiff() {
  TIFFSetErrorHandler(keep_reason);
  TIFFSetWarningHandler(keep_warning);  // mostly of tags that it does not know
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

std::string name_of_meaning(std::uint16_t photometric) {
  switch (photometric) {
    case PHOTOMETRIC_RGB:
      return "colors (RGB)";
    case PHOTOMETRIC_PALETTE:
      return "colors of a palette";
    case PHOTOMETRIC_MASK:
      return "a mask of transparency";
    case PHOTOMETRIC_SEPARATED:
      return "colors (CMYK)";
    case PHOTOMETRIC_YCBCR:
      return "colors (YCbCr)";
    case PHOTOMETRIC_CIELAB:
    case PHOTOMETRIC_ICCLAB:
    case PHOTOMETRIC_ITULAB:
      return "colors (Lab)";
    case PHOTOMETRIC_CFA:
      return "those of a camera's color filter";
    case PHOTOMETRIC_LOGL:
      return "logarithms (LogL)";
    case PHOTOMETRIC_LOGLUV:
      return "colors (LogLuv)";
    default:
      return fmt::format("of an unknown kind (PhotometricInterpretation {})", photometric);
  }
}

std::string name_of_storage(TIFF* tiff, const TiffPage& page) {
  const int packed_bits = page.packed_bits;
  const auto scheme = value_of<std::uint16_t>(tiff, TIFFTAG_COMPRESSION, COMPRESSION_NONE);
  switch (scheme) {
    case COMPRESSION_NONE:
      if (packed_bits != 0) return fmt::format("packed samples of {} bits", packed_bits);
      if (page.unwritten > 0) return "strips or tiles that were never written";
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

bool may_have_predictor(std::uint16_t scheme) {
  constexpr std::array schemes = {COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE, COMPRESSION_DEFLATE,
                                  COMPRESSION_ZSTD, COMPRESSION_LZMA};
  return std::ranges::find(schemes, scheme) != schemes.end();
}

bool is_lossless(std::uint16_t scheme) {
  constexpr std::array schemes = {COMPRESSION_NONE,      COMPRESSION_LZW,      COMPRESSION_ADOBE_DEFLATE,
                                  COMPRESSION_DEFLATE,   COMPRESSION_PACKBITS, COMPRESSION_LZMA,
                                  COMPRESSION_ZSTD,      COMPRESSION_CCITTRLE, COMPRESSION_CCITTRLEW,
                                  COMPRESSION_CCITTFAX3, COMPRESSION_CCITTFAX4};
  return std::ranges::find(schemes, scheme) != schemes.end();
}

}  // namespace tagrid
