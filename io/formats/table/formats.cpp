#include "io/formats/table/formats.h"

#include "io/formats/bmp/image.h"
#include "io/formats/metaimage/header.h"
#include "io/formats/nifti/header.h"
#include "io/formats/nrrd/header.h"
#include "io/formats/tiff/written.h"
#include "io/formats/vendors/vendors.h"
#include "io/formats/vti/written.h"
#include "io/formats/zarr/container.h"
#include "io/formats/zarr/written.h"
#include "io/text/text.h"
#include "io/volume/vtk.h"

namespace tagrid {
namespace {

using namespace std::string_view_literals;

std::vector<std::string> lost_in_vdb(const VolumeInfo& info) {
  if (!has_unknown_spacing(info.geometry())) return {};
  return {"OpenVDB cannot record that a spacing is unknown; 1 is written"};
}

std::vector<std::string> lost_in_vtkhdf(const VolumeInfo& info) {
  std::vector<std::string> lost = lost_in_image_data(info);
  // Seen with the library: it overruns its memory for the first, and forgets to use the second.
  if (info.dims.x == 1 || info.dims.y == 1 || info.dims.z == 1)
    lost.emplace_back("VTK 9.1 fails to read VTKHDF images of one sample along an axis; it reads .vti files");
  if (vtk_geometry_of(info.geometry()).direction != vtk_geometry_of({}).direction)
    lost.emplace_back("VTK 9.1 ignores the directions of VTKHDF images; it applies those of .vti files");
  return lost;
}

/// Also a folder that has lost its metadata but not its name: then the reader says what is missing.
bool is_zarr_folder(const std::string& folder) {
  const std::string path = folder.substr(0, folder.find_last_not_of('/') + 1);
  return has_zarr_metadata(folder) || lower_case(path).ends_with(".zarr");
}

// The same in one file and in two, and in gzip.
constexpr Keeps of_nifti = {.slices_are_alike = true,
                            .volumes = true,
                            .applies_rescale = true,
                            .loss = true,
                            .own_pairs = "nifti_",
                            .lost = lost_in_nifti};
constexpr Keeps of_meta_image = {
    .slices_are_alike = true, .loss = true, .own_pairs = "metaimage_", .lost = lost_in_meta_image};

}  // namespace

const std::vector<Format>& formats() {
  static const std::vector<Format> rows = {
      {.name = "nrrd",
       .extensions = {".nrrd"},
       .help = "header and samples",
       .what = "an NRRD volume",
       .reads = {.peek = 9, .is_mine = begins_nrrd, .open = open_nrrd, .takes_description = true},
       .writes = {.header = [](const VolumeInfo& info) { return nrrd_header_text(info); }, .any_order = true},
       .keeps = {.header = true}},
      {.name = "nhdr",
       .extensions = {".nhdr"},
       .help = "header, with samples in a .raw file beside it",
       .reads = {.as = "nrrd"},
       .writes = {.detached_header = detached_nrrd_header, .any_order = true, .samples_extension = ".raw"},
       .keeps = {.header = true}},
      {.name = "raw",
       .extensions = {".raw"},
       .help = "samples alone",
       .reads = {.open = open_raw, .takes_description = true},
       .writes = {.header = [](const VolumeInfo&) { return std::string(); }, .any_order = true}},
      {.name = "vdb",
       .extensions = {".vdb"},
       .help = "OpenVDB",
       .what = "an OpenVDB file",
       .has_grids = true,
       .reads = {.magic = {{" BDV\0\0\0\0"sv}}, .program = "vdb"},
       .writes = {.program = "vdb", .holds_volume = true},
       .keeps = {.slices_are_alike = true, .header = true, .lost = lost_in_vdb}},
      {.name = "nifti",
       .extensions = {".nii"},
       .help = "NIfTI",
       .what = "a NIfTI file",
       .reads =
           {.peek = 348, .is_mine = begins_nifti, .in_gzip = true, .open = open_nifti, .has_series = true},
       .writes = {.header = nifti_header_bytes, .any_order = true},
       .keeps = of_nifti},
      {.name = "nifti.gz",
       .extensions = {".nii.gz"},
       .help = "NIfTI in gzip",
       .reads = {.as = "nifti"},
       .writes = {.header = nifti_header_bytes, .in_gzip = true},
       .keeps = of_nifti},
      {.name = "metaimage",
       .extensions = {".mha"},
       .help = "MetaImage",
       .what = "a MetaImage file",
       .reads = {.peek = 14, .is_mine = begins_meta_image, .open = open_meta_image, .has_series = true},
       .writes = {.header = meta_image_header_text, .any_order = true},
       .keeps = of_meta_image},
      {.name = "mhd",
       .extensions = {".mhd"},
       .help = "MetaImage header, with samples in a .raw file beside it",
       .reads = {.as = "metaimage"},
       .writes = {.detached_header = detached_meta_image_header,
                  .any_order = true,
                  .samples_extension = ".raw"},
       .keeps = of_meta_image},
      // Before TIFF: a DICOM file may begin as one of TIFF does.
      {.name = "dicom",
       .extensions = {".dcm", ".ima"},
       .help = "DICOM",
       .what = "a DICOM file",
       .reads = {.magic = {{"DICM", 128}}, .program = "dicom", .has_folders = true}},
      {.name = "tiff",
       .extensions = {".tif", ".tiff"},
       .help = "TIFF",
       .what = "a TIFF file",
       // Of 32 and of 64 bits, in either byte order.
       .reads = {.magic = {{"II*\0"sv}, {"MM\0*"sv}, {"II+\0"sv}, {"MM\0+"sv}},
                 .program = "tiff",
                 .has_folders = true},
       .writes = {.header = tiff_headers, .any_order = true, .memory = memory_of_tiff},
       .keeps = {.slices_are_alike = true,
                 .loss = true,
                 .units = keeps_values_in_tiff,
                 .lost_rescale = lost_rescale_in_tiff,
                 .lost = lost_in_tiff}},
      {.name = "vti",
       .extensions = {".vti"},
       .help = "VTK image data",
       .writes = {.header = vti_header, .trailer = vti_trailer, .any_order = true},
       .keeps = {.slices_are_alike = true, .lost_rescale = lost_rescale_in_image_data, .lost = lost_in_vti}},
      {.name = "vtkhdf",
       .extensions = {".vtkhdf"},
       .help = "VTK image data in HDF5",
       .reads = {.as = "hdf5"},
       .writes = {.program = "hdf5"},
       .keeps = {.slices_are_alike = true,
                 .header = true,
                 .lost_rescale = lost_rescale_in_image_data,
                 .lost = lost_in_vtkhdf}},
      {.name = "vgi",
       .extensions = {".vgi"},
       .help = "VGStudio, with samples in a .vol file",
       .what = "a VGStudio file",
       .reads = {.peek = 64, .is_mine = begins_vgi, .open = open_vgi}},
      {.name = "xtekct",
       .extensions = {".xtekct"},
       .help = "Nikon, with samples in a .vol file",
       .what = "a Nikon file",
       .reads = {.peek = 16, .is_mine = begins_xtekct, .open = open_xtekct}},
      {.name = "isq",
       .extensions = {".isq"},
       .help = "Scanco",
       .what = "a Scanco file",
       .reads = {.peek = 16, .is_mine = begins_isq, .open = open_isq}},
      {.name = "hdf5",
       .extensions = {".h5", ".hdf5"},
       .help = "HDF5",
       .what = "an HDF5 file",
       // MATLAB has a block of its own before it.
       .reads = {.magic = {{"\x89HDF\r\n\x1a\n"}, {"\x89HDF\r\n\x1a\n", 512}}, .program = "hdf5"},
       .writes = {.program = "hdf5"},
       .keeps = {.applies_rescale = true, .header = true}},
      // A row of its own, as what is written is not NeXus.
      {.name = "nexus",
       .extensions = {".nxs"},
       .help = "NeXus, which is HDF5",
       .what = "a NeXus file",
       .reads = {.program = "hdf5"}},
      {.name = "zarr",
       .extensions = {".zarr", ".ozx"},
       .help = "OME-Zarr, a directory or one file (.ozx)",
       .what = "a Zarr hierarchy",
       .reads = {.peek = 128, .is_mine = begins_zarr_in_zip, .program = "zarr", .is_folder = is_zarr_folder},
       .writes = {.create = create_zarr, .has_levels = true, .memory = memory_of_zarr},
       .keeps = {.slices_are_alike = true,
                 .header = true,
                 .lost_rescale = lost_rescale_in_zarr,
                 .lost = lost_in_zarr}},
      {.name = "jp2",
       .extensions = {".jp2", ".j2k", ".j2c", ".jpc", ".jpx"},
       .help = "JPEG 2000",
       .what = "a JPEG 2000 file",
       // A code stream, or a file with boxes.
       .reads = {.magic = {{"\xff\x4f\xff\x51"}, {"\0\0\0\x0cjP  \r\n\x87\n"sv}},
                 .program = "jp2",
                 .has_folders = true}},
      {.name = "bmp",
       .extensions = {".bmp"},
       .help = "BMP",
       .what = "a BMP file",
       .reads = {.peek = 18, .is_mine = begins_bmp, .program = "bmp", .has_folders = true}},
  };
  return rows;
}

}  // namespace tagrid
