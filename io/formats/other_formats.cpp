#include "io/formats/other_formats.h"

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
      {.name = "dicom",
       .extensions = {".dcm"},
       .help = "DICOM",
       .what = "is a DICOM file; convert its series to an NRRD volume first, for example with 3D Slicer or "
               "plastimatch",
       .peek = 132,
       .is_mine = [](std::string_view b) { return has<128>(b, "DICM"); }},
      {.name = "nifti-header",
       .extensions = {".hdr"},
       .help = "NIfTI of two files",
       .what = "is the header of a NIfTI volume",
       .problem = Problem::nifti_header,
       .peek = 347,
       .is_mine = [](std::string_view b) { return has<344>(b, "ni1"); }},
      {.name = "nifti",
       .extensions = {".nii"},
       .help = "NIfTI",
       .what = "is a NIfTI file",
       .problem = Problem::nifti_file,
       .peek = 347,
       .is_mine = [](std::string_view b) { return has<344>(b, "n+1"); }},
      {.name = "metaimage",
       .extensions = {".mha", ".mhd"},
       .help = "MetaImage",
       .what = "is a MetaImage header",
       .problem = Problem::meta_image_header,
       .peek = 10,
       .is_mine = [](std::string_view b) { return has<0>(b, "ObjectType") || has<0>(b, "NDims"); }},
      {.name = "hdf5",
       .extensions = {".h5", ".hdf5"},
       .help = "HDF5",
       .what = "is an HDF5 file; convert it to an NRRD volume first",
       .peek = 4,
       .is_mine = [](std::string_view b) { return has<0>(b, "\x89HDF"); }},
      {.name = "tiff",
       .extensions = {".tif", ".tiff"},
       .help = "TIFF",
       .what = "is a TIFF file; convert it to an NRRD volume first",
       .peek = 4,
       .is_mine = [](std::string_view b) { return has<0>(b, "II*\0"sv) || has<0>(b, "MM\0*"sv); }},
  };
}

}  // namespace tagrid
