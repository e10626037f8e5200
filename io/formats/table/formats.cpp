#include "io/formats/table/formats.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <set>

#include "io/formats/amira/mesh_file.h"
#include "io/formats/bmp/image.h"
#include "io/formats/edf/edf_file.h"
#include "io/formats/metaimage/header.h"
#include "io/formats/mrc/map.h"
#include "io/formats/nifti/header.h"
#include "io/formats/npy/array.h"
#include "io/formats/nrrd/header.h"
#include "io/formats/png/outline.h"
#include "io/formats/tiff/written.h"
#include "io/formats/vendors/vendors.h"
#include "io/formats/vti/written.h"
#include "io/formats/zarr/container.h"
#include "io/formats/zarr/written.h"
#include "io/metadata/loss.h"
#include "io/programs/find.h"
#include "io/programs/volumes.h"
#include "io/samples/file_sink.h"
#include "io/text/paths.h"
#include "io/text/text.h"
#include "io/volume/given_spacing.h"
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
      {.name = "npy",
       .extensions = {".npy"},
       .help = "NumPy array",
       .what = "a NumPy array",
       .reads = {.magic = {{npy_magic}}, .open = open_npy, .has_series = true},
       .writes = {.header = npy_header_bytes, .any_order = true},
       .keeps = {.slices_are_alike = true,
                 .volumes = true,
                 .lost_rescale = lost_rescale_in_npy,
                 .lost = lost_in_npy}},
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
      {.name = "pyhst",
       .extensions = {".vol.info"},
       .help = "PyHST, with samples in a .vol file",
       .what = "a PyHST file",
       .reads = {.peek = 64, .is_mine = begins_pyhst, .open = open_pyhst}},
      {.name = "vff",
       .extensions = {".vff"},
       .help = "VFF of GE",
       .what = "a VFF file",
       .reads = {.magic = {{"ncaa\n"}, {"ncaa\r"}}, .open = open_vff}},
      {.name = "mrc",
       .extensions = {".mrc", ".rec", ".map", ".st", ".ali"},
       .help = "MRC, IMOD, CCP4",
       .what = "an MRC map",
       .reads = {.peek = mrc_header_bytes, .is_mine = begins_mrc, .open = open_mrc, .has_series = true}},
      // After VGStudio, whose files begin with a brace, too.
      {.name = "edf",
       .extensions = {".edf"},
       .help = "EDF of the ESRF",
       .what = "an EDF file",
       .reads = {.peek = 4096,
                 .is_mine = begins_edf,
                 .open = open_edf,
                 .open_folder = open_edf_folder,
                 .has_folders = true}},
      {.name = "amira",
       .extensions = {".am"},
       .help = "AmiraMesh",
       .what = "an AmiraMesh file",
       .reads = {.magic = {{"# AmiraMesh"}, {"# Avizo"}}, .open = open_amira}},
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
      // A row of its own, as what is written is not N5.
      {.name = "n5",
       .extensions = {".n5"},
       .help = "N5, a directory",
       .what = "an N5 container",
       .reads = {.program = "zarr", .is_folder = is_n5_folder}},
      {.name = "zeiss",
       .extensions = {".txm", ".txrm", ".xrm"},
       .help = "Zeiss TXM and TXRM",
       .what = "a Zeiss TXM or TXRM file",
       // OLE2, in which other programs store documents.
       .reads = {.named_magic = {{"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"}}, .program = "zeiss"}},
      {.name = "jp2",
       .extensions = {".jp2", ".j2k", ".j2c", ".jpc", ".jpx", ".jph", ".jhc"},
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
      {.name = "png",
       .extensions = {".png"},
       .help = "PNG",
       .what = "a PNG file",
       .reads = {.peek = png_header_bytes,
                 .is_mine = begins_gray_png,
                 .program = "png",
                 .has_folders = true,
                 .are_often_pictures = true}},
  };
  return rows;
}

// Formats by their names, by names of files, and by what files begin with.

std::size_t Reads::bytes_to_recognize() const {
  std::size_t most = peek;
  for (const Magic& one : magic) most = std::max(most, one.at + one.bytes.size());
  return most;
}

bool begins_with_any(std::string_view beginning, const std::vector<Magic>& magic) {
  return std::ranges::any_of(magic, [&](const Magic& one) {
    return beginning.size() >= one.at && beginning.substr(one.at).starts_with(one.bytes);
  });
}

bool Reads::begins(std::string_view beginning) const {
  return begins_with_any(beginning, magic) || (is_mine != nullptr && is_mine(beginning));
}

namespace {

/// Returns the format that an installed program adds, or nullptr without such a program.
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
  added.format.name = added.format.writes.program = added.name;
  added.format.extensions = {added.extension};
  added.format.help = added.help;
  return &added.format;
}

}  // namespace

std::vector<const Format*> written_formats() {
  std::vector<const Format*> written;
  for (const Format& format : formats())
    if (format.writes.any()) written.push_back(&format);
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
  throw UsageError("{}: must be one of {}", name, fmt::join(names, ", "));
}

const Format* format_with_extension(const std::string& path) {
  const std::string name = lower_case(name_of_path(path));
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
  throw UsageError("{}: the name of a volume must end in {}", path, endings);
}

namespace {

std::unique_ptr<VolumeSink> create_detached(const Format& format, const std::string& path,
                                            const VolumeInfo& info, const SinkOptions& options) {
  if (path == "-")
    throw UsageError("a detached header ({}) needs a file name; choose {} or raw", format.name,
                     read_format_named(format.reads.as)->extensions.front().substr(1));
  const std::filesystem::path samples = path_of(samples_path(path, format));
  if (samples == path_of(path))
    throw UsageError("{}: a detached header cannot be named {}", path, format.writes.samples_extension);
  const std::string header = format.writes.detached_header(info, text_of(samples.filename()));
  auto header_file =
      std::make_unique<OutputFile>(path, options.overwrite, OutputFileOptions{.like = options.like});
  auto samples_file =
      std::make_unique<OutputFile>(text_of(samples), options.overwrite, output_options(options));
  return std::make_unique<DetachedSink>(info, std::move(header_file), std::move(samples_file), header);
}

}  // namespace

std::unique_ptr<VolumeSink> create_volume(const Format& format, const std::string& path,
                                          const VolumeInfo& info, const WriteOptions& options) {
  if (format.writes.detached_header != nullptr) return create_detached(format, path, info, options.files);
  if (format.writes.create != nullptr) return format.writes.create(path, info, options.known, options.files);
  if (format.writes.header != nullptr) {
    const std::string header = format.writes.header(info);
    auto file = std::make_unique<OutputFile>(path, options.files.overwrite, output_options(options.files));
    if (format.writes.in_gzip) return gzip_sink(info, std::move(file), header);
    return std::make_unique<AttachedSink>(info, std::move(file), header, std::string(format.writes.trailer));
  }
  const std::string program = writer_for(path, format.help, format.writes.program);
  auto wishes = options.wishes;
  wishes["format"] = format.name;
  return create_with_writer(program, path, info, options.files, wishes, options.first_memory);
}

const Format* read_format_named(std::string_view name) {
  for (const Format& format : formats())
    if (format.name == name && format.reads.any()) return &format;
  return nullptr;
}

std::vector<std::string> read_format_names() {
  std::set<std::string> names;
  for (const Format& format : formats())
    if (format.reads.any()) names.emplace(format.name);
  for (const FoundProgram& reader : all_readers()) names.insert(reader.name);
  return {names.begin(), names.end()};
}

std::size_t bytes_to_recognize() {
  std::size_t most = 0;
  for (const Format& format : formats()) most = std::max(most, format.reads.bytes_to_recognize());
  return most;
}

const Format* format_of(std::string_view beginning) {
  for (const Format& format : formats())
    if (format.reads.any() && format.reads.begins(beginning)) return &format;
  return nullptr;
}

const Format* format_of_folder(const std::string& folder) {
  for (const Format& format : formats())
    if (format.reads.is_folder != nullptr && format.reads.is_folder(folder)) return &format;
  return nullptr;
}

std::string samples_path(const std::string& path, const Format& format) {
  if (format.writes.samples_extension.empty()) return path;
  return text_of(path_of(path).replace_extension(path_of(format.writes.samples_extension)));
}

// What a volume loses in files of other formats, in words.

namespace {

/// True for pairs that say nothing more: their content is in the samples and in the geometry, or belongs to
/// one kind of files.
bool is_said_otherwise(std::string_view key, std::string_view value, const Format& format) {
  constexpr std::array<std::string_view, 18> said = {"rescale_",
                                                     "applied_",
                                                     "slice_applied_",
                                                     "slice_positions",
                                                     "slice_slopes",
                                                     "slice_intercepts",
                                                     "dicom_added_intercept",
                                                     given_spacing_key,
                                                     "hdf5_dataset",
                                                     "hdf5_element_size_um",
                                                     "metaimage_AnatomicalOrientation",
                                                     "nifti_pixdim",
                                                     "nifti_scl_",
                                                     "nifti_qoffset_",
                                                     "nifti_quatern_",
                                                     "nifti_qform_",
                                                     "nifti_sform_",
                                                     "nifti_srow_"};
  if (key == lossy_source_key) return format.keeps.loss;
  if (key == "slice files") return true;
  const auto begins = [&](std::string_view beginning) { return key.starts_with(beginning); };
  // ITK writes it into every file.
  if (key == "metaimage_CenterOfRotation" &&
      std::ranges::all_of(words_of(value), [](auto word) { return number_of(word) == 0.0; }))
    return true;
  return begins("vdb_") || std::ranges::any_of(said, begins) ||
         (!format.keeps.own_pairs.empty() && begins(format.keeps.own_pairs));
}

/// False for the two lines that NRRD's own library puts into every header.
bool is_remark(std::string_view comment) {
  return !trimmed(comment).empty() && comment.find("NRRD file format specification") == comment.npos &&
         comment.find("teem.sourceforge.net/nrrd/format") == comment.npos;
}

/// True for the unit that values of CT have everywhere.
bool is_usual_unit(std::string_view unit) { return trimmed(unit) == "HU"; }

/// True if a file of the format has no place for the unit of values.
bool loses_unit(const Format& format, const VolumeInfo& info) {
  return !format.keeps.header && !format.keeps.units(info);
}

/// True for what the reader of DICOM notes for each series.
bool is_of_dicom(std::string_view key) {
  return key.starts_with("dicom_") || key == "slice_sop_instance_uids";
}

/// "2 key/value pairs ("owner", "year")"
std::string in_words(const std::vector<std::string>& keys, std::string_view one, std::string_view several) {
  constexpr std::size_t most = 3;
  std::vector<std::string> shown;
  for (std::size_t i = 0; i < std::min(keys.size(), most); ++i)
    shown.push_back(quoted(std::string_view(keys[i])));
  return fmt::format("{} {} ({}{})", keys.size(), keys.size() == 1 ? one : several, fmt::join(shown, ", "),
                     keys.size() > most ? ", ..." : "");
}

std::string no_place_for(const Format& format, const std::string& what) {
  return fmt::format("{} files have no place for {}; the .tag file and .nrrd files have them",
                     format.extensions.front(), what);
}

/// The texts of a header that a file of the format loses, in words; "" if it keeps all of them.
std::string lost_texts(const Format& format, const VolumeInfo& info) {
  std::vector<std::string> keys, others;
  for (const auto& [key, value] : info.metadata.pairs())
    if (!is_said_otherwise(key, value, format) && !is_of_dicom(key)) keys.push_back(key);
  bool has_comments = false;
  for (const MetadataEntry& entry : info.metadata.entries()) {
    has_comments =
        has_comments || (entry.kind == MetadataEntry::Kind::comment && is_remark(entry.line.substr(1)));
    for (const std::string_view field :
         {"content", "labels", "thicknesses", "sample units", "measurement frame"})
      if (entry.field == field) others.push_back(fmt::format("the field {}", quoted(field)));
  }
  if (has_comments) others.emplace_back("comments");
  if (!keys.empty()) others.insert(others.begin(), in_words(keys, "key/value pair", "key/value pairs"));
  return others.empty() ? "" : no_place_for(format, fmt::format("{}", fmt::join(others, ", ")));
}

}  // namespace

std::string usual_losses(const Format& format, const VolumeInfo& info) {
  if (!format.keeps.slices_are_alike || format.keeps.header) return "";
  std::vector<std::string> keys, lost;
  for (const auto& [key, value] : info.metadata.pairs()) {
    if (!is_said_otherwise(key, value, format) && is_of_dicom(key)) keys.push_back(key);
    if (key == "rescale_units" && is_usual_unit(value) && loses_unit(format, info))
      lost.emplace_back("the unit of values (HU)");
  }
  if (!keys.empty()) lost.insert(lost.begin(), in_words(keys, "attribute of DICOM", "attributes of DICOM"));
  return lost.empty() ? "" : no_place_for(format, fmt::format("{}", fmt::join(lost, ", ")));
}

std::vector<std::string> losses(const Format& format, const VolumeInfo& info) {
  std::vector<std::string> all = format.keeps.lost(info);
  if (!format.keeps.slices_are_alike) return all;
  if (!format.keeps.header)
    if (std::string texts = lost_texts(format, info); !texts.empty()) all.push_back(std::move(texts));
  std::vector<std::string> differences;
  for (const auto& [key, value] : info.metadata.pairs()) {
    // On its own: whoever measures in the file measures wrong.
    if (key == "slice_positions")
      all.push_back(
          fmt::format("slices lie at unequal distances (slice_positions), but {} stores one distance, so its "
                      "slices are not where those of the scan are; the .tag file and .nrrd files have them",
                      format.name));
    if (key == "slice_slopes") differences.emplace_back("slices have individual slopes (slice_slopes)");
    if (key == "rescale_units" && !is_usual_unit(value) && loses_unit(format, info))
      differences.push_back(fmt::format("values are in {} (rescale_units)", quoted(std::string_view(value))));
  }
  if (!differences.empty())
    all.push_back(fmt::format(
        "{}, which {} cannot hold; the .tag file and .nrrd files have them{}",
        fmt::join(differences, ", and "), format.name,
        info.metadata.has_slopes_of_slices() ? "; the values in this file are the stored samples" : ""));
  return all;
}

}  // namespace tagrid
