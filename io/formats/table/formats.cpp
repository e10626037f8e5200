#include "io/formats/table/formats.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <set>

#include "io/formats/bmp/image.h"
#include "io/formats/metaimage/header.h"
#include "io/formats/nifti/header.h"
#include "io/formats/nrrd/header.h"
#include "io/formats/table/other_formats.h"
#include "io/formats/tiff/written.h"
#include "io/formats/vendors/vendors.h"
#include "io/formats/vti/written.h"
#include "io/programs/find.h"
#include "io/programs/volumes.h"
#include "io/samples/file_sink.h"
#include "io/samples/gzip_sink.h"
#include "io/text/text.h"
#include "io/volume/vtk_geometry.h"

namespace tagrid {
namespace {

using namespace std::string_view_literals;

std::vector<std::string> lost_in_vdb(const VolumeInfo& info) {
  if (!has_unknown_spacing(info.geometry)) return {};
  return {"OpenVDB cannot record that a spacing is unknown; 1 is written"};
}

std::vector<std::string> lost_in_vtkhdf(const VolumeInfo& info) {
  std::vector<std::string> lost = lost_in_image_data(info);
  // Seen with the library: it overruns its memory for the first, and forgets to use the second.
  if (info.dims.x == 1 || info.dims.y == 1 || info.dims.z == 1)
    lost.emplace_back("VTK 9.1 fails to read VTKHDF images of one sample along an axis; it reads .vti files");
  if (vtk_geometry_of(info.geometry).direction != vtk_geometry_of({}).direction)
    lost.emplace_back("VTK 9.1 ignores the directions of VTKHDF images; it applies those of .vti files");
  return lost;
}

std::vector<Format> all_formats() {
  std::vector<Format> rows = {
      {.name = "nrrd",
       .extensions = {".nrrd"},
       .help = "header and samples",
       .what = "an NRRD volume",
       .peek = 9,
       .is_mine = begins_nrrd,
       .open = open_nrrd,
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
       .header = nifti_header_bytes,
       .any_order = true,
       .slices_are_alike = true,
       .applies_rescale = true,
       .own_pairs = "nifti_",
       .lost = lost_in_nifti},
      {.name = "nifti.gz",
       .extensions = {".nii.gz"},
       .help = "NIfTI in gzip",
       .read_as = "nifti",
       .header = nifti_header_bytes,
       .writes_gzip = true,
       .slices_are_alike = true,
       .applies_rescale = true,
       .own_pairs = "nifti_",
       .lost = lost_in_nifti},
      {.name = "metaimage",
       .extensions = {".mha"},
       .help = "MetaImage",
       .what = "a MetaImage file",
       .peek = 14,
       .is_mine = begins_meta_image,
       .open = open_meta_image,
       .header = meta_image_header_text,
       .any_order = true,
       .slices_are_alike = true,
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
       .keeps_units = keeps_values_in_tiff,
       .lost = lost_in_tiff,
       .memory = memory_of_tiff},
      {.name = "vti",
       .extensions = {".vti"},
       .help = "VTK image data",
       .header = vti_header,
       .trailer = vti_trailer,
       .any_order = true,
       .slices_are_alike = true,
       .lost = lost_in_vti},
      {.name = "vtkhdf",
       .extensions = {".vtkhdf"},
       .help = "VTK image data in HDF5",
       .read_as = "hdf5",
       .writer = "hdf5",
       .slices_are_alike = true,
       .keeps_header = true,
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
  for (Format& other : other_formats()) rows.push_back(std::move(other));
  return rows;
}

}  // namespace

std::size_t Format::bytes_to_recognise() const {
  std::size_t most = peek;
  for (const Magic& one : magic) most = std::max(most, one.at + one.bytes.size());
  return most;
}

bool Format::begins(std::string_view beginning) const {
  const auto has = [&](const Magic& one) {
    return beginning.size() >= one.at && beginning.substr(one.at).starts_with(one.bytes);
  };
  return std::ranges::any_of(magic, has) || (is_mine != nullptr && is_mine(beginning));
}

const std::vector<Format>& formats() {
  static const std::vector<Format> table = all_formats();
  return table;
}

namespace {

/// The format of a program that somebody added; nullptr if there is none.
const Format* added_format(std::string_view name) {
  struct Added {
    std::string name, extension, help;
    Format format;
  };
  static std::map<std::string, Added, std::less<>> known;
  if (const auto found = known.find(name); found != known.end()) return &found->second.format;
  if (read_format_named(name) != nullptr || !find_writer(name)) return nullptr;
  Added& added = known[std::string(name)];
  added.name = name;
  added.extension = "." + added.name;
  added.help = "written by tagrid-write-" + added.name;
  added.format.name = added.format.writer = added.name;
  added.format.extensions = {added.extension};
  added.format.help = added.help;
  return &added.format;
}

}  // namespace

std::vector<const Format*> written_formats() {
  std::vector<const Format*> written;
  for (const Format& format : formats())
    if (format.is_written()) written.push_back(&format);
  return written;
}

const Format& format_named(std::string_view name) {
  std::vector<std::string_view> names;
  for (const Format* format : written_formats()) {
    if (format->name == name) return *format;
    names.push_back(format->name);
  }
  for (const Format* format : written_formats())
    for (const std::string_view extension : format->extensions)
      if (!extension.empty() && extension.substr(1) == name) return *format;
  if (const Format* added = added_format(name)) return *added;
  throw UsageError(fmt::format("{}: must be one of {}", name, fmt::join(names, ", ")));
}

const Format* format_with_extension(const std::string& path) {
  const std::string name = lower_case(std::filesystem::path(path).filename().string());
  for (const Format* format : written_formats())
    for (const std::string_view extension : format->extensions)
      if (name.size() > extension.size() && name.ends_with(extension)) return format;
  const std::size_t dot = name.rfind('.');
  return dot == name.npos || dot == 0 ? nullptr : added_format(std::string_view(name).substr(dot + 1));
}

const Format& format_from_name(const std::string& path) {
  if (path == "-") return format_named("raw");
  if (const Format* format = format_with_extension(path)) return *format;
  std::string endings;
  const auto written = written_formats();
  for (const Format* format : written)
    endings += fmt::format("{}{} ({})",
                           format == written.front()  ? ""
                           : format == written.back() ? " or "
                                                      : ", ",
                           format->extensions.front(), format->help);
  throw UsageError(fmt::format("{}: the name of a volume must end in {}", path, endings));
}

namespace {

std::unique_ptr<VolumeSink> create_detached(const Format& format, const std::string& path,
                                            const VolumeInfo& info, const SinkOptions& options) {
  if (path == "-")
    throw UsageError(fmt::format("a detached header ({}) needs a file name; choose {} or raw", format.name,
                                 read_format_named(format.read_as)->extensions.front().substr(1)));
  const std::filesystem::path samples = samples_path(path, format);
  if (samples == std::filesystem::path(path))
    throw UsageError(fmt::format("{}: a detached header cannot be named {}", path, format.samples_extension));
  const std::string header = format.detached_header(info, samples.filename().string());
  auto header_file =
      std::make_unique<OutputFile>(path, options.overwrite, OutputFileOptions{.like = options.like});
  auto samples_file =
      std::make_unique<OutputFile>(samples.string(), options.overwrite, output_options(options));
  return std::make_unique<DetachedSink>(info, std::move(header_file), std::move(samples_file), header);
}

}  // namespace

std::unique_ptr<VolumeSink> create_volume(const Format& format, const std::string& path,
                                          const VolumeInfo& info, const WriteOptions& options) {
  if (format.detached_header != nullptr) return create_detached(format, path, info, options.files);
  if (format.header != nullptr) {
    const std::string header = format.header(info);
    auto file = std::make_unique<OutputFile>(path, options.files.overwrite, output_options(options.files));
    if (format.writes_gzip) return std::make_unique<GzipSink>(info, std::move(file), header);
    return std::make_unique<AttachedSink>(info, std::move(file), header, std::string(format.trailer));
  }
  const std::string program = writer_for(path, format.help, format.writer);
  auto wishes = options.wishes;
  wishes["format"] = format.name;
  return create_with_writer(program, path, info, options.files, wishes, options.first_memory);
}

const Format* read_format_named(std::string_view name) {
  for (const Format& format : formats())
    if (format.name == name && format.is_read()) return &format;
  return nullptr;
}

std::vector<std::string> read_format_names() {
  std::set<std::string> names;
  for (const Format& format : formats())
    if (format.is_read()) names.emplace(format.name);
  for (const FoundProgram& reader : all_readers()) names.insert(reader.name);
  return {names.begin(), names.end()};
}

std::size_t bytes_to_recognise() {
  std::size_t most = 0;
  for (const Format& format : formats()) most = std::max(most, format.bytes_to_recognise());
  return most;
}

const Format* format_of(std::string_view beginning, bool is_read) {
  for (const Format& format : formats())
    if (format.is_read() == is_read && format.begins(beginning)) return &format;
  return nullptr;
}

std::string samples_path(const std::string& path, const Format& format) {
  if (format.samples_extension.empty()) return path;
  return std::filesystem::path(path).replace_extension(format.samples_extension).string();
}

}  // namespace tagrid
