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

}  // namespace

const std::vector<Format>& formats() {
  static const std::vector<Format> rows = {
      {.name = "nrrd",
       .extensions = {".nrrd"},
       .help = "header and samples",
       .what = "an NRRD volume",
       .peek = 9,
       .is_mine = begins_nrrd,
       .open = open_nrrd,
       .takes_description = true,
       .header = [](const VolumeInfo& info) { return nrrd_header_text(info); },
       .any_order = true,
       .keeps_header = true},
      {.name = "nhdr",
       .extensions = {".nhdr"},
       .help = "header, with samples in a .raw file beside it",
       .read_as = "nrrd",
       .detached_header = detached_nrrd_header,
       .any_order = true,
       .samples_extension = ".raw",
       .keeps_header = true},
      {.name = "raw",
       .extensions = {".raw"},
       .help = "samples alone",
       .open = open_raw,
       .takes_description = true,
       .header = [](const VolumeInfo&) { return std::string(); },
       .any_order = true},
      {.name = "vdb",
       .extensions = {".vdb"},
       .help = "OpenVDB",
       .what = "an OpenVDB file",
       .magic = {{" BDV\0\0\0\0"sv}},
       .reader = "vdb",
       .writer = "vdb",
       .writer_keeps_volume = true,
       .has_grids = true,
       .slices_are_alike = true,
       .keeps_header = true,
       .lost = lost_in_vdb},
      {.name = "nifti",
       .extensions = {".nii"},
       .help = "NIfTI",
       .what = "a NIfTI file",
       .peek = 348,
       .is_mine = begins_nifti,
       .in_gzip = true,
       .open = open_nifti,
       .has_series = true,
       .header = nifti_header_bytes,
       .any_order = true,
       .slices_are_alike = true,
       .has_volumes = true,
       .applies_rescale = true,
       .keeps_loss = true,
       .own_pairs = "nifti_",
       .lost = lost_in_nifti},
      {.name = "nifti.gz",
       .extensions = {".nii.gz"},
       .help = "NIfTI in gzip",
       .read_as = "nifti",
       .header = nifti_header_bytes,
       .writes_gzip = true,
       .slices_are_alike = true,
       .has_volumes = true,
       .applies_rescale = true,
       .keeps_loss = true,
       .own_pairs = "nifti_",
       .lost = lost_in_nifti},
      {.name = "metaimage",
       .extensions = {".mha"},
       .help = "MetaImage",
       .what = "a MetaImage file",
       .peek = 14,
       .is_mine = begins_meta_image,
       .open = open_meta_image,
       .has_series = true,
       .header = meta_image_header_text,
       .any_order = true,
       .slices_are_alike = true,
       .keeps_loss = true,
       .own_pairs = "metaimage_",
       .lost = lost_in_meta_image},
      {.name = "mhd",
       .extensions = {".mhd"},
       .help = "MetaImage header, with samples in a .raw file beside it",
       .read_as = "metaimage",
       .detached_header = detached_meta_image_header,
       .any_order = true,
       .samples_extension = ".raw",
       .slices_are_alike = true,
       .keeps_loss = true,
       .own_pairs = "metaimage_",
       .lost = lost_in_meta_image},
      // Before TIFF: a DICOM file may begin as one of TIFF does.
      {.name = "dicom",
       .extensions = {".dcm", ".ima"},
       .help = "DICOM",
       .what = "a DICOM file",
       .magic = {{"DICM", 128}},
       .reader = "dicom",
       .has_folders = true},
      {.name = "tiff",
       .extensions = {".tif", ".tiff"},
       .help = "TIFF",
       .what = "a TIFF file",
       // Of 32 and of 64 bits, in either byte order.
       .magic = {{"II*\0"sv}, {"MM\0*"sv}, {"II+\0"sv}, {"MM\0+"sv}},
       .reader = "tiff",
       .has_folders = true,
       .header = tiff_headers,
       .any_order = true,
       .slices_are_alike = true,
       .keeps_loss = true,
       .keeps_units = keeps_values_in_tiff,
       .lost_rescale = lost_rescale_in_tiff,
       .lost = lost_in_tiff,
       .memory = memory_of_tiff},
      {.name = "vti",
       .extensions = {".vti"},
       .help = "VTK image data",
       .header = vti_header,
       .trailer = vti_trailer,
       .any_order = true,
       .slices_are_alike = true,
       .lost_rescale = lost_rescale_in_image_data,
       .lost = lost_in_vti},
      {.name = "vtkhdf",
       .extensions = {".vtkhdf"},
       .help = "VTK image data in HDF5",
       .read_as = "hdf5",
       .writer = "hdf5",
       .slices_are_alike = true,
       .keeps_header = true,
       .lost_rescale = lost_rescale_in_image_data,
       .lost = lost_in_vtkhdf},
      {.name = "vgi",
       .extensions = {".vgi"},
       .help = "VGStudio, with samples in a .vol file",
       .what = "a VGStudio file",
       .peek = 64,
       .is_mine = begins_vgi,
       .open = open_vgi},
      {.name = "xtekct",
       .extensions = {".xtekct"},
       .help = "Nikon, with samples in a .vol file",
       .what = "a Nikon file",
       .peek = 16,
       .is_mine = begins_xtekct,
       .open = open_xtekct},
      {.name = "isq",
       .extensions = {".isq"},
       .help = "Scanco",
       .what = "a Scanco file",
       .peek = 16,
       .is_mine = begins_isq,
       .open = open_isq},
      {.name = "hdf5",
       .extensions = {".h5", ".hdf5"},
       .help = "HDF5",
       .what = "an HDF5 file",
       // MATLAB has a block of its own before it.
       .magic = {{"\x89HDF\r\n\x1a\n"}, {"\x89HDF\r\n\x1a\n", 512}},
       .reader = "hdf5",
       .writer = "hdf5",
       .applies_rescale = true,
       .keeps_header = true},
      // A row of its own, as what is written is not NeXus.
      {.name = "nexus",
       .extensions = {".nxs"},
       .help = "NeXus, which is HDF5",
       .what = "a NeXus file",
       .reader = "hdf5"},
      {.name = "zarr",
       .extensions = {".zarr", ".ozx"},
       .help = "OME-Zarr, a directory or one file (.ozx)",
       .what = "a Zarr hierarchy",
       .peek = 128,
       .is_mine = begins_zarr_in_zip,
       .reader = "zarr",
       .is_folder = is_zarr_folder,
       .create = create_zarr,
       .has_levels = true,
       .slices_are_alike = true,
       .keeps_header = true,
       .lost_rescale = lost_rescale_in_zarr,
       .lost = lost_in_zarr,
       .memory = memory_of_zarr},
      {.name = "jp2",
       .extensions = {".jp2", ".j2k", ".j2c", ".jpc", ".jpx"},
       .help = "JPEG 2000",
       .what = "a JPEG 2000 file",
       // A code stream, or a file with boxes.
       .magic = {{"\xff\x4f\xff\x51"}, {"\0\0\0\x0cjP  \r\n\x87\n"sv}},
       .reader = "jp2",
       .has_folders = true},
      {.name = "bmp",
       .extensions = {".bmp"},
       .help = "BMP",
       .what = "a BMP file",
       .peek = 18,
       .is_mine = begins_bmp,
       .reader = "bmp",
       .has_folders = true},
  };
  return rows;
}

}  // namespace tagrid
