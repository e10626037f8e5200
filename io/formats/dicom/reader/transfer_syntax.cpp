#include "io/formats/dicom/reader/transfer_syntax.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "io/text/text.h"

namespace tagrid {
namespace {

struct Syntax {
  std::string_view uid;
  SyntaxUse use;
  std::string_view name;
};

using enum SyntaxUse;

constexpr std::array syntaxes = {
    Syntax{"1.2.840.10008.1.2", native, "Little Endian Implicit"},
    Syntax{"1.2.840.10008.1.2.1", native, "Little Endian Explicit"},
    Syntax{"1.2.840.10008.1.2.2", native, "Big Endian Explicit"},
    Syntax{"1.2.840.10008.1.2.1.99", deflated, "Deflated Explicit VR Little Endian"},
    Syntax{"1.2.840.10008.1.2.1.98", plain_fragments, "Encapsulated Uncompressed Explicit VR Little Endian"},
    Syntax{"1.2.840.10008.1.2.4.50", decoded, "JPEG Baseline"},
    Syntax{"1.2.840.10008.1.2.4.51", decoded, "JPEG Extended, Process 2+4"},
    Syntax{"1.2.840.10008.1.2.4.57", decoded, "JPEG Lossless, Non-hierarchical, Process 14"},
    Syntax{"1.2.840.10008.1.2.4.70", decoded, "JPEG Lossless, Non-hierarchical, 1st Order Prediction"},
    Syntax{"1.2.840.10008.1.2.4.80", decoded, "JPEG-LS Lossless"},
    Syntax{"1.2.840.10008.1.2.4.81", decoded, "JPEG-LS Lossy (Near-lossless)"},
    Syntax{"1.2.840.10008.1.2.4.90", decoded, "JPEG 2000 (Lossless only)"},
    Syntax{"1.2.840.10008.1.2.4.91", decoded, "JPEG 2000 (Lossless or Lossy)"},
    Syntax{"1.2.840.10008.1.2.4.110", decoded, "JPEG XL Lossless"},
    Syntax{"1.2.840.10008.1.2.4.111", decoded, "JPEG XL JPEG Recompression"},
    Syntax{"1.2.840.10008.1.2.4.112", decoded, "JPEG XL"},
    Syntax{"1.2.840.10008.1.2.4.201", decoded, "High-Throughput JPEG 2000 (Lossless only)"},
    Syntax{"1.2.840.10008.1.2.4.202", decoded, "High-Throughput JPEG 2000 with RPCL (Lossless only)"},
    Syntax{"1.2.840.10008.1.2.4.203", decoded, "High-Throughput JPEG 2000"},
    Syntax{"1.2.840.10008.1.2.5", decoded, "RLE Lossless"},
    Syntax{"1.2.840.10008.1.2.4.92", refused, "JPEG 2000 Multicomponent (Lossless only)"},
    Syntax{"1.2.840.10008.1.2.4.93", refused, "JPEG 2000 Multicomponent"},
    Syntax{"1.2.840.10008.1.2.4.94", refused, "JPIP Referenced"},
    Syntax{"1.2.840.10008.1.2.4.95", refused, "JPIP Referenced Deflate"},
    Syntax{"1.2.840.10008.1.2.4.204", refused, "JPIP HTJ2K Referenced"},
    Syntax{"1.2.840.10008.1.2.4.205", refused, "JPIP HTJ2K Referenced Deflate"},
    Syntax{"1.2.840.10008.1.2.8.1", refused, "Deflated Image Frame Compression"},
    Syntax{"1.2.840.10008.1.2.6.1", refused, "RFC 2557 MIME Encapsulation"},
    Syntax{"1.2.840.10008.1.2.6.2", refused, "XML Encoding"},
    Syntax{"1.2.840.10008.1.20", refused, "Papyrus 3 Implicit VR Little Endian"},
    Syntax{"1.2.840.113619.5.2", refused, "GE Private Implicit VR Little Endian with Big Endian Pixel Data"},
};

/// JPEG 10918-1 with other processes, which were retired, and video.
std::string_view family_of(std::string_view uid) {
  constexpr std::string_view of_jpeg = "1.2.840.10008.1.2.4.", of_video_transport = "1.2.840.10008.1.2.7.";
  if (uid.starts_with(of_video_transport)) return "SMPTE ST 2110";
  if (!uid.starts_with(of_jpeg)) return "";
  // "100.1" is 100 in fragments.
  const std::string_view rest = uid.substr(of_jpeg.size());
  const auto number = whole_number_of(rest.substr(0, rest.find('.')));
  if (!number) return "";
  if (*number >= 50 && *number <= 66) return "JPEG, a retired process";
  if (*number >= 100 && *number <= 106) return "MPEG-2 or MPEG-4 video";
  return *number >= 107 && *number <= 108 ? "HEVC video" : "";
}

}  // namespace

TransferSyntax transfer_syntax(std::string_view uid) {
  const auto* const found = std::ranges::find(syntaxes, uid, &Syntax::uid);
  if (found != syntaxes.end()) return {found->use, found->name};
  const std::string_view family = family_of(uid);
  return family.empty() ? TransferSyntax{} : TransferSyntax{refused, family};
}

std::string in_words(const TransferSyntax& syntax, std::string_view uid) {
  return syntax.name.empty() ? std::string(uid) : fmt::format("{} ({})", syntax.name, uid);
}

}  // namespace tagrid
