#include "io/formats/other_formats.h"

#include "io/nifti/header.h"

namespace tagrid {
namespace {

using namespace std::string_view_literals;

template <std::size_t at>
bool has(std::string_view beginning, std::string_view magic) {
  return beginning.size() >= at && beginning.substr(at).starts_with(magic);
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
      {.name = "compressed",
       .extensions = {".gz", ".zst", ".xz", ".bz2"},
       .help = "gzip, zstd, xz or bzip2",
       .what = "is compressed",
       .problem = Problem::compressed_file,
       .peek = 5,
       .is_mine =
           [](std::string_view b) {
             return has<0>(b, "\x1f\x8b") || has<0>(b, "\x28\xb5\x2f\xfd") || has<0>(b, "\xfd\x37zXZ") ||
                    has<0>(b, "BZh");
           }},
      {.name = "analyze",
       .extensions = {".img"},
       .help = "Analyze 7.5",
       .what = "is the header of an Analyze 7.5 volume, which does not say how it lies in space; convert it "
               "to NIfTI "
               "first",
       .peek = 348,
       .is_mine =
           [](std::string_view b) {
             return has<38>(b, "r") && (b.starts_with("\x5c\1\0\0"sv) || b.starts_with("\0\0\1\x5c"sv)) &&
                    !begins_nifti(b);
           }},
  };
}

}  // namespace tagrid
