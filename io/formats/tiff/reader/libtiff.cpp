#include "io/formats/tiff/reader/libtiff.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstdio>
#include <string_view>

namespace tagrid {
namespace {

/// What decoding gives.
enum class Use : std::uint8_t {
  lossless,        ///< the numbers that were stored
  with_predictor,  ///< the same; differences of samples may be stored, too
  other            ///< other numbers, or none
};
struct Scheme {
  std::uint16_t number;
  const char* name;
  Use use = Use::other;
};
constexpr std::array schemes = {Scheme{COMPRESSION_NONE, "none", Use::lossless},
                                Scheme{COMPRESSION_LZW, "LZW", Use::with_predictor},
                                Scheme{COMPRESSION_ADOBE_DEFLATE, "deflate", Use::with_predictor},
                                Scheme{COMPRESSION_DEFLATE, "deflate", Use::with_predictor},
                                Scheme{COMPRESSION_PACKBITS, "PackBits", Use::lossless},
                                Scheme{COMPRESSION_LZMA, "LZMA", Use::with_predictor},
                                Scheme{COMPRESSION_ZSTD, "zstd", Use::with_predictor},
                                Scheme{COMPRESSION_CCITTRLE, "CCITT fax", Use::lossless},
                                Scheme{COMPRESSION_CCITTRLEW, "CCITT fax", Use::lossless},
                                Scheme{COMPRESSION_CCITTFAX3, "CCITT fax", Use::lossless},
                                Scheme{COMPRESSION_CCITTFAX4, "CCITT fax", Use::lossless},
                                Scheme{COMPRESSION_JPEG, "JPEG"},
                                Scheme{COMPRESSION_OJPEG, "the JPEG of old TIFF files"},
                                Scheme{COMPRESSION_LERC, "LERC"},
                                Scheme{COMPRESSION_WEBP, "WebP"},
                                Scheme{COMPRESSION_JXL, "JPEG XL"},
                                Scheme{33003, "JPEG 2000"},
                                Scheme{33005, "JPEG 2000"},
                                Scheme{COMPRESSION_JP2000, "JPEG 2000"}};

Use use_of(std::uint16_t scheme) {
  const auto* const known = std::ranges::find(schemes, scheme, &Scheme::number);
  return known == schemes.end() ? Use::other : known->use;
}

struct Meaning {
  std::uint16_t number;
  const char* name;
};
constexpr std::array meanings = {Meaning{PHOTOMETRIC_RGB, "colors (RGB)"},
                                 Meaning{PHOTOMETRIC_PALETTE, "colors of a palette"},
                                 Meaning{PHOTOMETRIC_MASK, "a mask of transparency"},
                                 Meaning{PHOTOMETRIC_SEPARATED, "colors (CMYK)"},
                                 Meaning{PHOTOMETRIC_YCBCR, "colors (YCbCr)"},
                                 Meaning{PHOTOMETRIC_CIELAB, "colors (Lab)"},
                                 Meaning{PHOTOMETRIC_ICCLAB, "colors (Lab)"},
                                 Meaning{PHOTOMETRIC_ITULAB, "colors (Lab)"},
                                 Meaning{PHOTOMETRIC_CFA, "those of a camera's color filter"},
                                 Meaning{PHOTOMETRIC_LOGL, "logarithms (LogL)"},
                                 Meaning{PHOTOMETRIC_LOGLUV, "colors (LogLuv)"}};

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
  const auto* const known = std::ranges::find(schemes, scheme, &Scheme::number);
  return known == schemes.end() ? fmt::format("scheme {}", scheme) : known->name;
}

std::string name_of_meaning(std::uint16_t photometric) {
  const auto* const known = std::ranges::find(meanings, photometric, &Meaning::number);
  return known == meanings.end()
             ? fmt::format("of an unknown kind (PhotometricInterpretation {})", photometric)
             : known->name;
}

std::string name_of_storage(TIFF* tiff, const TiffPage& page) {
  const auto scheme = value_of<std::uint16_t>(tiff, TIFFTAG_COMPRESSION, COMPRESSION_NONE);
  if (scheme != COMPRESSION_NONE) return name_of_compression(scheme);
  if (page.packed_bits != 0) return fmt::format("packed samples of {} bits", page.packed_bits);
  if (page.unwritten > 0) return "strips or tiles that were never written";
  return TIFFIsTiled(tiff) != 0 ? "tiles" : "scattered strips";
}

bool may_have_predictor(std::uint16_t scheme) { return use_of(scheme) == Use::with_predictor; }

bool is_lossless(std::uint16_t scheme) {
  return use_of(scheme) == Use::lossless || use_of(scheme) == Use::with_predictor;
}

}  // namespace tagrid
