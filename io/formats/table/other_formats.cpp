#include "io/formats/table/other_formats.h"

#include "io/formats/nifti/header.h"

namespace tagrid {
namespace {

using namespace std::string_view_literals;

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

/// Anything may be in it. `what` is for messages.
Format compressed(std::string_view name, std::string_view extension, std::string_view what,
                  std::string_view beginning) {
  return {.name = name,
          .extensions = {extension},
          .help = name,
          .what = what,
          .problem = Problem::compressed_file,
          .magic = {{beginning}}};
}

}  // namespace

std::vector<Format> other_formats() {
  return {
      {.name = "tag",
       .extensions = {".tag"},
       .help = "what encode makes",
       .what = "is already a .tag file; decode it, or give the original volume",
       .magic = {{"\x89TAG"}}},
      compressed("gzip", ".gz", "is compressed (gzip)", "\x1f\x8b"),
      compressed("zstd", ".zst", "is compressed (zstd)", "\x28\xb5\x2f\xfd"),
      compressed("xz", ".xz", "is compressed (xz)", "\xfd\x37zXZ"),
      compressed("bzip2", ".bz2", "is compressed (bzip2)", "BZh"),
      {.name = "zip",
       .extensions = {".zip"},
       .help = "zip archive",
       .what = "is a zip archive; unpack it first",
       .magic = {{"PK\x03\x04"}}},
      {.name = "tar",
       .extensions = {".tar"},
       .help = "tar archive",
       .what = "is a tar archive; unpack it first",
       .magic = {{"ustar", 257}}},
      {.name = "matlab",
       .extensions = {".mat"},
       .help = "MATLAB, versions 5 to 7",
       .what = "is a MATLAB file of version 5 to 7; save it in MATLAB as version 7.3, which is HDF5",
       .magic = {{"MATLAB 5.0"}}},
      {.name = "analyze",
       .extensions = {".img"},
       .help = "Analyze 7.5",
       .what = "is the header of an Analyze 7.5 volume, which does not record its orientation; convert it to "
               "NIfTI first",
       .peek = 348,
       .is_mine = begins_analyze},
  };
}

}  // namespace tagrid
