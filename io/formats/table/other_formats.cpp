#include "io/formats/table/other_formats.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "io/formats/nifti/header.h"
#include "io/formats/png/outline.h"
#include "io/formats/table/layouts.h"
#include "io/formats/zarr/container.h"
#include "io/system/files.h"
#include "io/text/paths.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;
using namespace std::string_view_literals;

constexpr std::string_view images = "convert it to TIFF, for example with ImageMagick";
constexpr std::string_view bio_formats = "convert it to OME-TIFF, with bfconvert of Bio-Formats or with Fiji";
constexpr std::string_view unpack = "unpack it first";
constexpr std::string_view give_samples = "give the file or the directory of the samples";

std::uint32_t big_endian_at(std::string_view b, std::size_t at) {
  std::uint32_t number = 0;
  for (std::size_t i = at; i < at + 4; ++i)
    number = number << 8 | (i < b.size() ? static_cast<unsigned char>(b[i]) : 0u);
  return number;
}

/// A header of Analyze 7.5 has no magic number. It is recognized by its size, together with the
/// letter "r" (regular), which some programs leave out, or with plausible numbers of axes and bits.
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

bool begins_other_zip(std::string_view b) { return b.starts_with("PK\x03\x04") && !begins_zarr_in_zip(b); }

bool begins_npz(std::string_view b) {
  // The name of the first member.
  return begins_other_zip(b) && b.size() > 30 &&
         b.substr(30, static_cast<unsigned char>(b[26])).ends_with(".npy");
}

/// Version 1, sizes, frames and one of the types.
bool begins_mgh(std::string_view b) {
  if (b.size() < 28 || big_endian_at(b, 0) != 1 || big_endian_at(b, 20) > 10) return false;
  for (const std::size_t at : {4, 8, 12, 16})
    if (const auto size = big_endian_at(b, at); size == 0 || size >= 65536) return false;
  return true;
}

/// Numbers of the version and of the byte order, after a length of 4 bytes or of 8.
bool begins_gatan(std::string_view b) {
  const std::uint32_t version = big_endian_at(b, 0);
  return b.size() > 16 &&
         ((version == 3 && big_endian_at(b, 8) <= 1) || (version == 4 && big_endian_at(b, 12) <= 1));
}

bool begins_xml_with(std::string_view b, std::string_view element) {
  const std::size_t begin = b.find_first_not_of("\xEF\xBB\xBF \t\r\n");
  return begin != b.npos && b[begin] == '<' && b.substr(0, 1024).find(element) != b.npos;
}

bool begins_skyscan_log(std::string_view b) {
  const std::string text = lower_case(std::string(b.substr(0, 512)));
  return text.starts_with("[system]") && text.find("scanner=") != text.npos;
}

/// Anything may be in it. `what` is for messages.
OtherFormat compressed(std::string_view name, std::string_view what, std::string_view beginning) {
  return {
      .name = name, .what = what, .advice = "", .magic = {{beginning}}, .problem = Problem::compressed_file};
}

OtherFormat archive(std::string_view name, std::string_view what, Magic magic) {
  return {.name = name, .what = what, .advice = unpack, .magic = {magic}};
}

std::vector<OtherFormat> rows_of_volumes() {
  return {
      {.name = "tag",
       .what = "is already a .tag file",
       .advice = "decode it, or give the original volume",
       .magic = {{"\x89TAG"}}},
      {.name = "OLE2",
       .what = "is an OLE2 file, such as an Olympus OIB image",
       .advice =
           "export it as TIFF in the scanner's program, or convert it with bfconvert; a Zeiss scan needs its "
           "extension (.txm, .txrm)",
       .magic = {{"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"}}},
      {.name = "HyperSurface",
       .what = "is a surface of Amira or Avizo",
       .advice = "give the volume",
       .magic = {{"# HyperSurface"}}},
      {.name = "MGH",
       .what = "is a FreeSurfer MGH volume",
       .advice = "convert it to NIfTI with mri_convert, or with Python's nibabel",
       .is_mine = begins_mgh,
       .layout = layout_of_mgh},
      {.name = "MGZ",
       .what = "is a FreeSurfer MGZ volume",
       .advice = "convert it to NIfTI with mri_convert, or with Python's nibabel",
       .magic = {{"\x1f\x8b"}},
       .extensions = {".mgz"}},
      {.name = "N5",
       .what = "is the description of an N5 container",
       .advice = "give the directory that contains it",
       .is_mine = begins_n5},
      {.name = "FITS",
       .what = "is a FITS file",
       .advice = "convert it to TIFF with Python's astropy and tifffile",
       .magic = {{"SIMPLE  ="}},
       .layout = layout_of_fits},
      {.name = "VTK",
       .what = "is a VTK file",
       .advice = "if it holds an image, save it in ParaView as MetaImage (.mhd) or TIFF",
       .magic = {{"# vtk DataFile Version"}},
       .is_mine = [](std::string_view b) { return begins_xml_with(b, "<VTKFile"); }},
      {.name = "DM",
       .what = "is a Gatan DM3 or DM4 file",
       .advice = "save it as TIFF in DigitalMicrograph or Fiji, or with Python's ncempy",
       .is_mine = begins_gatan},
      {.name = "AIM",
       .what = "is a Scanco AIM volume",
       .advice = "export it as ISQ or DICOM in Scanco's program",
       .magic = {{"AIMDATA_V030"}, {"\x14\0\0\0\x8c\0\0\0"sv}}},
      {.name = "GIPL",
       .what = "is a GIPL volume",
       .advice = "convert it to NIfTI with c3d of ITK-SNAP",
       .magic = {{"\xef\xff\xe9\xb0", 252}, {"\x2a\xe3\x89\xb8", 252}}},
      {.name = "Interfile",
       .what = "is the header of an Interfile volume",
       .advice = "convert it to DICOM or NIfTI with medcon",
       .magic = {{"!INTERFILE"}}},
      {.name = "ECAT",
       .what = "is an ECAT volume",
       .advice = "convert it to NIfTI, for example with Python's nibabel",
       .magic = {{"MATRIX7"}}},
      {.name = "PAR",
       .what = "is the header of a Philips PAR/REC volume",
       .advice = "convert it to NIfTI with dcm2niix or with parrec2nii of Python's nibabel",
       .magic = {{"# === DATA DESCRIPTION FILE"}}},
      {.name = "ParaVision",
       .what = "is a parameter file of Bruker ParaVision",
       .advice = "export the scan as DICOM, or convert it to NIfTI with brkraw",
       .magic = {{"##TITLE="}}},
      {.name = "NetCDF",
       .what = "is a NetCDF 3 or MINC 1 file",
       .advice = "convert it to HDF5: NetCDF with nccopy, MINC with mincconvert",
       .magic = {{"CDF\1"}, {"CDF\2"}, {"CDF\5"}}},
      {.name = "HDF4",
       .what = "is an HDF4 file",
       .advice = "convert it to HDF5 with h4toh5convert",
       .magic = {{"\x0e\x03\x13\x01"}}},
      {.name = "MATLAB",
       .what = "is a MATLAB file of version 5 to 7",
       .advice = "save it in MATLAB as version 7.3, which tagrid reads",
       .magic = {{"MATLAB 5.0"}}},
      {.name = "Analyze",
       .what = "is the header of an Analyze 7.5 volume, which does not record its orientation",
       .advice = "convert it to NIfTI first",
       .is_mine = begins_analyze},
      {.name = "SkyScan log",
       .what = "is a SkyScan log, which describes slices or projections",
       .advice = "give the directory of the reconstructed slices",
       .is_mine = begins_skyscan_log},
      {.name = "BigDataViewer",
       .what = "is a description of BigDataViewer",
       .advice = "give the HDF5 file that it names, and choose one of its data sets",
       .is_mine = [](std::string_view b) { return begins_xml_with(b, "<SpimData"); }},
      {.name = "ICS",
       .what = "is an ICS file",
       .advice = bio_formats,
       .magic = {{"\t\nics_version"}, {"\t\r\nics_version"}, {"\t\nversion"}, {"\t\r\nversion"}}},
      {.name = "CZI", .what = "is a Zeiss CZI file", .advice = bio_formats, .magic = {{"ZISRAWFILE"}}},
      {.name = "LIF",
       .what = "is a Leica LIF file",
       .advice = bio_formats,
       .is_mine =
           [](std::string_view b) {
             return b.starts_with("\x70\0\0\0"sv) && b.size() > 8 && b[8] == '\x2a';
           }},
      {.name = "ND2", .what = "is a Nikon ND2 file", .advice = bio_formats, .magic = {{"\xda\xce\xbe\x0a"}}},
  };
}

std::vector<OtherFormat> rows_of_images_and_archives() {
  return {
      {.name = "PNG",
       .what = "is a PNG image, but not one of gray samples of 8 or 16 bits",
       .advice = "convert it to such an image, if its colors stand for single numbers",
       .is_mine =
           [](std::string_view b) { return b.starts_with("\x89PNG\r\n\x1a\n") && !begins_gray_png(b); }},
      {.name = "JPEG", .what = "is a JPEG image", .advice = images, .magic = {{"\xff\xd8\xff"}}},
      {.name = "GIF", .what = "is a GIF image", .advice = images, .magic = {{"GIF8"}}},
      {.name = "WebP",
       .what = "is a WebP image",
       .advice = images,
       .is_mine = [](std::string_view b) { return b.starts_with("RIFF") && b.find("WEBP") == 8; }},
      {.name = "OpenEXR", .what = "is an OpenEXR image", .advice = images, .magic = {{"\x76\x2f\x31\x01"}}},
      {.name = "PGM",
       .what = "is a PGM or PPM image",
       .advice = images,
       .is_mine =
           [](std::string_view b) {
             return b.size() > 3 && b[0] == 'P' && b[1] >= '1' && b[1] <= '6' &&
                    (is_digit(b[3]) || b[3] == '#') && (b[2] == '\n' || b[2] == ' ' || b[2] == '\r');
           }},
      {.name = "PDF", .what = "is a PDF document", .advice = "give a volume", .magic = {{"%PDF-"}}},
      compressed("gzip", "is compressed (gzip)", "\x1f\x8b"),
      compressed("zstd", "is compressed (zstd)", "\x28\xb5\x2f\xfd"),
      compressed("xz", "is compressed (xz)", "\xfd\x37zXZ"),
      compressed("bzip2", "is compressed (bzip2)", "BZh"),
      archive("lz4", "is compressed (lz4)", {"\x04\x22\x4d\x18"}),
      {.name = "NumPy archive",
       .what = "is a NumPy archive (.npz)",
       .advice = "save its array with numpy.save() as a .npy file",
       .is_mine = begins_npz},
      {.name = "zip", .what = "is a zip archive", .advice = unpack, .is_mine = begins_other_zip},
      archive("tar", "is a tar archive", {"ustar", 257}),
      archive("7z", "is a 7z archive", {"7z\xbc\xaf\x27\x1c"}),
      archive("RAR", "is a RAR archive", {"Rar!\x1a\x07"}),
      // By their names alone.
      {.name = "VGL",
       .what = "is a VGStudio project, which contains no samples",
       .advice = "give the .vgi file of the volume, or export the volume as TIFF or DICOM",
       .extensions = {".vgl"}},
      {.name = "REK",
       .what = "is named like a volume of Fraunhofer's programs (.rek)",
       .advice = "export it as TIFF in that program, or describe its samples if you know their layout",
       .extensions = {".rek"}},
      {.name = "PCR",
       .what = "is a description of phoenix datos|x",
       .advice = give_samples,
       .extensions = {".pcr"}},
  };
}

}  // namespace

const std::vector<OtherFormat>& other_formats() {
  static const std::vector<OtherFormat> rows = [] {
    std::vector<OtherFormat> all = rows_of_volumes();
    for (OtherFormat& row : rows_of_images_and_archives()) all.push_back(std::move(row));
    return all;
  }();
  return rows;
}

const OtherFormat* other_format_of(std::string_view beginning, const std::string& path) {
  const std::string extension = extension_of(path);
  for (const OtherFormat& row : other_formats()) {
    const bool goes_by_names = row.magic.empty() && row.is_mine == nullptr;
    const bool is_named = std::ranges::find(row.extensions, extension) != row.extensions.end();
    const bool begins = goes_by_names || begins_with_any(beginning, row.magic) ||
                        (row.is_mine != nullptr && row.is_mine(beginning));
    if (!beginning.empty() && begins && (row.extensions.empty() || is_named)) return &row;
  }
  return nullptr;
}

Sentence about_other_format(const OtherFormat& format, std::string_view beginning,
                            std::optional<std::uint64_t> size) {
  Sentence sentence = std::string(format.what);
  if (!format.advice.empty()) sentence = {"{}; {}", format.what, format.advice};
  const auto layout = format.layout == nullptr ? std::nullopt : format.layout(beginning);
  if (!layout || size != layout->offset + *sample_bytes(layout->dims, layout->type)) return sentence;
  const Index3& dims = layout->dims;
  sentence = {"{}; or describe its samples: {} {},{},{} {} {} {} {}",
              sentence,
              Setting{"dims", "size"},
              dims.x,
              dims.y,
              dims.z,
              Setting{"type", "type"},
              name_of(layout->type),
              Setting{"offset", "offset"},
              layout->offset};
  if (size_of(layout->type) > 1 && layout->big_endian.value_or(false))
    sentence = {"{} {} big", sentence, Setting{"endian", "byte order"}};
  return sentence;
}

}  // namespace tagrid
