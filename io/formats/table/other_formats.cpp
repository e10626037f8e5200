#include "io/formats/table/other_formats.h"

#include "io/formats/nifti/header.h"

namespace tagrid {
namespace {

using namespace std::string_view_literals;

template <std::size_t at>
bool has(std::string_view beginning, std::string_view magic) {
  return beginning.size() >= at && beginning.substr(at).starts_with(magic);
}

/// A header of Analyze 7.5 has no magic number: its size must do, with the word "r" (regular), which some
/// programs leave out, or a number of axes and bits that samples may have.
bool begins_analyze(std::string_view b) {
  const bool is_little = b.starts_with("\x5c\1\0\0"sv);
  if (b.size() < 348 || (!is_little && !b.starts_with("\0\0\1\x5c"sv)) || begins_nifti(b)) return false;
  if (b[38] == 'r') return true;
  const auto number = [&](std::size_t at) {
    const auto low = static_cast<unsigned char>(b[is_little ? at : at + 1]),
               high = static_cast<unsigned char>(b[is_little ? at + 1 : at]);
    return low + 256 * high;
  };
  const int axes = number(40), bits = number(72);
  return axes >= 1 && axes <= 7 && bits <= 128 && (bits == 1 || (bits > 0 && bits % 8 == 0));
}

}  // namespace

std::vector<Format> other_formats() {
  return {
      {.name = "tag",
       .extensions = {".tag"},
       .help = "what encode makes",
       .what = "is already a .tag file; decode it, or give the original volume",
       .peek = 4,
       .is_mine = [](std::string_view b) { return has<0>(b, "\x89TAG"); }},
      {.name = "gzip",
       .extensions = {".gz"},
       .help = "gzip",
       .what = "is compressed (gzip)",
       .problem = Problem::compressed_file,
       .peek = 2,
       .is_mine = [](std::string_view b) { return has<0>(b, "\x1f\x8b"); }},
      {.name = "zstd",
       .extensions = {".zst"},
       .help = "zstd",
       .what = "is compressed (zstd)",
       .problem = Problem::compressed_file,
       .peek = 4,
       .is_mine = [](std::string_view b) { return has<0>(b, "\x28\xb5\x2f\xfd"); }},
      {.name = "xz",
       .extensions = {".xz"},
       .help = "xz",
       .what = "is compressed (xz)",
       .problem = Problem::compressed_file,
       .peek = 5,
       .is_mine = [](std::string_view b) { return has<0>(b, "\xfd\x37zXZ"); }},
      {.name = "bzip2",
       .extensions = {".bz2"},
       .help = "bzip2",
       .what = "is compressed (bzip2)",
       .problem = Problem::compressed_file,
       .peek = 3,
       .is_mine = [](std::string_view b) { return has<0>(b, "BZh"); }},
      {.name = "zip",
       .extensions = {".zip"},
       .help = "zip archive",
       .what = "is a zip archive; unpack it first",
       .peek = 4,
       .is_mine = [](std::string_view b) { return has<0>(b, "PK\x03\x04"); }},
      {.name = "tar",
       .extensions = {".tar"},
       .help = "tar archive",
       .what = "is a tar archive; unpack it first",
       .peek = 262,
       .is_mine = [](std::string_view b) { return has<257>(b, "ustar"); }},
      {.name = "matlab",
       .extensions = {".mat"},
       .help = "MATLAB, versions 5 to 7",
       .what = "is a MATLAB file of version 5 to 7; save it in MATLAB as version 7.3, which is HDF5",
       .peek = 10,
       .is_mine = [](std::string_view b) { return has<0>(b, "MATLAB 5.0"); }},
      {.name = "analyze",
       .extensions = {".img"},
       .help = "Analyze 7.5",
       .what = "is the header of an Analyze 7.5 volume, which does not say how it lies in space; convert it "
               "to NIfTI "
               "first",
       .peek = 348,
       .is_mine = begins_analyze},
  };
}

}  // namespace tagrid
