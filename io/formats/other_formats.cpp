#include "io/formats/other_formats.h"

namespace tagrid {

using namespace std::string_view_literals;

OtherFormat other_format(std::string_view beginning) {
  const auto has = [&](std::size_t at, std::string_view magic) {
    return beginning.size() >= at + magic.size() && beginning.substr(at, magic.size()) == magic;
  };
  if (has(0, "\x89TAG"sv)) return {"is a .tag file already; decode it, or give the volume"};
  if (has(0, "\x1f\x8b"sv) || has(0, "\x28\xb5\x2f\xfd"sv) || has(0, "\xfd\x37zXZ"sv) || has(0, "BZh"sv))
    return {"is compressed", Problem::compressed_file};
  if (has(128, "DICM"sv))
    return {
        "is a DICOM file; make an NRRD volume of its series first, with 3D Slicer or plastimatch, for "
        "example"};
  if (has(344, "ni1"sv)) return {"is the header of a NIfTI volume", Problem::nifti_header};
  if (has(344, "n+1"sv)) return {"is a NIfTI file", Problem::nifti_file};
  if (has(0, "ObjectType"sv) || has(0, "NDims"sv))
    return {"is a MetaImage header", Problem::meta_image_header};
  if (has(0, "\x89HDF"sv) || has(0, "II*\0"sv) || has(0, "MM\0*"sv))
    return {"is an HDF5 or TIFF file; make an NRRD volume of it first"};
  return {};
}

}  // namespace tagrid
