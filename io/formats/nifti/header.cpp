#include "io/formats/nifti/header.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <utility>

#include "io/errors/errors.h"
#include "io/files/compressed_bytes.h"
#include "io/formats/nifti/fields.h"
#include "io/metadata/fields.h"
#include "io/metadata/loss.h"
#include "io/metadata/rescale.h"
#include "io/samples/data_files.h"
#include "io/samples/file_samples.h"
#include "io/system/files.h"
#include "io/text/foreign_number.h"
#include "io/text/paths.h"
#include "io/volume/one_of_volumes.h"
#include "io/volume/volume_source.h"

namespace tagrid {
namespace {

using namespace std::string_view_literals;
using namespace nifti;

/// What is kept as pairs, in this order, unless all of it is 0.
constexpr std::array kept = {descrip,   aux_file,   intent_name,    intent_code, intent_p,   dim_info,
                             pixdim,    scl_slope,  scl_inter,      cal_min,     cal_max,    slice_start,
                             slice_end, slice_code, slice_duration, toffset,     xyzt_units, qform_code,
                             quatern,   qoffset,    sform_code,     srow[0],     srow[1],    srow[2]};

enum class Magic { none, first, first_pair, second, second_pair };

Magic magic_of(std::string_view bytes) {
  if (bytes.size() >= 348 && (bytes.starts_with("\x5c\1\0\0"sv) || bytes.starts_with("\0\0\1\x5c"sv))) {
    const std::string_view magic = bytes.substr(344, 4);
    if (magic == "n+1\0"sv) return Magic::first;
    if (magic == "ni1\0"sv) return Magic::first_pair;
  }
  if (bytes.size() >= 12 && (bytes.starts_with("\x1c\2\0\0"sv) || bytes.starts_with("\0\0\2\x1c"sv))) {
    const std::string_view magic = bytes.substr(4, 8);
    if (magic == "n+2\0\r\n\032\n"sv) return Magic::second;
    if (magic == "ni2\0\r\n\032\n"sv) return Magic::second_pair;
  }
  return Magic::none;
}

SampleType type_of(std::int64_t code) {
  if (const auto found = std::ranges::find(datatypes, code, &std::pair<int, SampleType>::first);
      found != datatypes.end())
    return found->second;
  const char* name = code == 1                                    ? "single bits"
                     : code == 32 || code == 1792 || code == 2048 ? "complex numbers"
                     : code == 128 || code == 2304                ? "colors"
                     : code == 1024 || code == 1280               ? "integers of 64 bits"
                     : code == 1536                               ? "floats of 128 bits"
                                                                  : "of no known type";
  throw BrokenInput("NIfTI header: samples are {} (datatype {}), which are not supported", name, code);
}

/// The samples of one volume along x, y, z, and the number of volumes.
std::pair<Index3, std::int64_t> dims_of(const Fields& fields) {
  const std::int64_t axes = fields.integer(dim);
  if (axes < 1 || axes > 7)
    throw BrokenInput("NIfTI header: dim[0], the number of axes, is {}, not 1 to 7", axes);
  std::array<std::int64_t, 8> sizes = {};
  std::int64_t volumes = 1;
  for (std::size_t i = 1; i < 8; ++i) {
    sizes[i] = static_cast<std::int64_t>(i) <= axes ? fields.integer(dim, i) : 1;
    if (sizes[i] < 1) throw BrokenInput("NIfTI header: dim[{}] is {}", i, sizes[i]);
    if (i > 3 && __builtin_mul_overflow(volumes, sizes[i], &volumes))
      throw BrokenInput("NIfTI header: there are too many volumes");
  }
  return {{sizes[1], sizes[2], sizes[3]}, volumes};
}

/// "If scl_slope is 0, there is no scaling"; files in use have NaN for that as well.
Rescale rescale_of(const Fields& fields, NiftiHeader& header) {
  const double slope = fields.number(scl_slope), intercept = fields.number(scl_inter);
  const bool has_none = slope == 0 || std::isnan(slope);
  if (!std::isfinite(slope) && !(has_none && (intercept == 0 || std::isnan(intercept))))
    header.scale_doubt = fmt::format(
        "NIfTI header: scl_slope is {}, which is not a number, and scl_inter is {}; what values samples mean "
        "is unknown",
        slope, intercept);
  if (has_none || std::isinf(slope)) return {};
  if (std::isinf(intercept))
    header.scale_doubt = fmt::format(
        "NIfTI header: scl_slope is {}, and scl_inter {}, which is not a number; what "
        "values samples mean is unknown",
        slope, intercept);
  else if (const std::string remark = remark_on(foreign_number(intercept), "scl_inter", "it counts as 0");
           !remark.empty())
    header.warnings.push_back(fmt::format("NIfTI header: {}; scl_slope is {}", remark, slope));
  return {slope, std::isfinite(intercept) ? intercept : 0, ""};
}

void check_meaning(const Fields& fields, SampleType type, NiftiHeader& header) {
  // What samples are if they are not measurements, by `intent_code`.
  static const std::map<std::int64_t, std::string_view> meanings = {{1002, "labels"},
                                                                    {1003, "labels"},
                                                                    {1004, "parts of matrices"},
                                                                    {1005, "parts of matrices"},
                                                                    {1006, "parts of vectors"},
                                                                    {1007, "parts of vectors"},
                                                                    {1008, "points"},
                                                                    {1009, "triangles"},
                                                                    {1010, "parts of quaternions"},
                                                                    {2003, "parts of colors"},
                                                                    {2004, "parts of colors"}};
  const std::int64_t intent = fields.integer(intent_code), bits = fields.integer(bitpix);
  if (const auto meaning = meanings.find(intent); meaning != meanings.end())
    header.not_understood.push_back(
        fmt::format("NIfTI header: intent_code {} says that samples are {}, but they will be treated as "
                    "intensities",
                    intent, meaning->second));
  const auto bits_of_type = static_cast<std::int64_t>(8 * size_of(type));
  if (bits != bits_of_type)
    header.not_understood.push_back(fmt::format(
        "NIfTI header: bitpix is {}, but samples of datatype {} have {} bits; the datatype counts", bits,
        fields.integer(datatype), bits_of_type));
}

/// The moments of volumes along a fourth axis of time; none for other axes.
std::vector<std::string> moments(const Fields& fields, std::int64_t volumes) {
  static const std::map<std::int64_t, std::string_view> units = {{8, "s"}, {16, "ms"}, {24, "us"}};
  const auto unit = units.find(fields.integer(xyzt_units) & 0x38);
  const double step = fields.number(pixdim, 4), first = fields.number(toffset);
  if (unit == units.end() || !(step > 0) || !std::isfinite(step) || !std::isfinite(first) ||
      volumes > most_volumes || (fields.integer(dim) > 4 && fields.integer(dim, 4) != volumes))
    return {};
  std::vector<std::string> names;
  for (std::int64_t i = 0; i < volumes; ++i)
    names.push_back(fmt::format("{:.9g} {}", first + static_cast<double>(i) * step, unit->second));
  return names;
}

std::uint64_t offset_of(const Fields& fields, bool is_pair, std::size_t header_bytes) {
  const double offset = fields.number(vox_offset);
  // Four bytes that announce extensions follow the header of a file of one part. Without an offset, samples
  // follow them.
  const auto least = static_cast<double>(is_pair ? 0 : header_bytes + 4);
  if (offset == 0) return is_pair ? 0 : header_bytes + 4;
  if (!(offset >= least && offset <= 0x1p62) || offset != std::floor(offset))
    throw BrokenInput(
        "NIfTI header: vox_offset is {}, which is impossible: it must be a whole number of at least {}",
        offset, least);
  return static_cast<std::uint64_t>(offset);
}

}  // namespace

bool begins_nifti(std::string_view bytes) { return magic_of(bytes) != Magic::none; }

NiftiHeader parse_nifti_header(std::string_view bytes) {
  const Magic found = magic_of(bytes);
  const bool is_second = found == Magic::second || found == Magic::second_pair;
  const std::size_t header_bytes = is_second ? 540 : 348;
  if (found == Magic::none || bytes.size() < header_bytes)
    throw BrokenInput("the NIfTI header is not complete");
  const Fields fields(bytes, is_second);
  const auto [dims, volumes] = dims_of(fields);
  NiftiHeader header;
  header.big_endian = fields.is_big_endian();
  header.is_pair = found == Magic::first_pair || found == Magic::second_pair;
  header.offset = offset_of(fields, header.is_pair, header_bytes);
  if (!header.is_pair && fields.number(vox_offset) == 0)
    header.warnings.push_back(fmt::format(
        "NIfTI header: vox_offset is 0, within the header; samples are read from byte {} on", header.offset));
  header.volumes = volumes;
  header.rescale = rescale_of(fields, header);
  const SampleType type = type_of(fields.integer(datatype));
  check_meaning(fields, type, header);
  const auto volume_bytes = sample_bytes(dims, type);
  std::uint64_t all = 0;
  if (!volume_bytes || __builtin_mul_overflow(*volume_bytes, static_cast<std::uint64_t>(volumes), &all) ||
      all > std::uint64_t{1} << 62)
    throw BrokenInput("NIfTI header: {} volumes of {} are beyond all memory", volumes, described(dims, type));
  KeyValues pairs;
  for (const Field& field : kept) {
    auto [text, loss] = field.name == descrip.name ? text_with_loss(fields.text(field))
                                                   : TextWithLoss{fields.text(field), ""};
    if (!text.empty()) pairs.emplace_back(fmt::format("nifti_{}", field.name), std::move(text));
    if (!loss.empty()) pairs.emplace_back(lossy_source_key, std::move(loss));
  }
  add_rescale(header.rescale, pairs);
  header.info = {dims, type, Metadata(geometry_of_fields(fields, dims, header.warnings), pairs)};
  if (volumes > 1) {
    header.pairs_of_volumes = {{fmt::format("nifti_{}", dim.name), fields.text(dim)}};
    header.volume_names = moments(fields, volumes);
  }
  return header;
}

// NIfTI volumes from files.

namespace {

namespace fs = std::filesystem;

NiftiHeader read_header(FileBytes& file) {
  try {
    return parse_nifti_header(begins_gzip(file) ? beginning_of_gzip(file, max_nifti_header_bytes)
                                                : std::string(file.peek(max_nifti_header_bytes)));
  } catch (const BrokenInput& error) {
    throw BrokenInput("{}: {}", file.name(), error.what());
  }
}

/// The file of the samples beside a header: scan.img or scan.img.gz beside scan.hdr or scan.hdr.gz.
std::string image_path(const std::string& path, const std::string& name) {
  if (path == "-")
    throw UsageError(name +
                     ": is a NIfTI header, whose samples are in another file; give the header by its name");
  fs::path image = path_of(path);
  if (image.extension() == ".gz") image.replace_extension();
  const bool is_upper = image.extension() == ".HDR";
  image.replace_extension(is_upper ? ".IMG" : ".img");
  for (const std::string& candidate : {text_of(image), text_of(image) + ".gz"})
    if (const auto status = status_of(candidate); status && status->is_file()) return candidate;
  throw WorldError("{}: is a NIfTI header, but the file of its samples is missing: {}", name, text_of(image));
}

/// The file of a header without its samples, which may be compressed, too.
PlainHeader plain_header(const std::string& path) {
  return [path]() -> PlainFile {
    FileBytes file(path);
    if (begins_gzip(file)) return {plain_name(path), true, {PlainPiece::content(0, 0)}};
    return {path, false, {PlainPiece::stretch(0, 0, file.size().value_or(0))}};
  };
}

}  // namespace

std::unique_ptr<VolumeSource> open_nifti(std::unique_ptr<FileBytes> file, const std::string& path,
                                         const SourceDescription& source) {
  const std::string name = file->name();
  NiftiHeader header = read_header(*file);
  const std::optional<std::int64_t> number = wanted_volume(source, name, header.info, header.volumes);
  const std::uint64_t before = header.offset + static_cast<std::uint64_t>(number.value_or(0)) *
                                                   *sample_bytes(header.info.dims, header.info.type);
  SourceFacts facts;
  facts.info = std::move(header.info);
  if (!number) {
    take_all_volumes(facts.info, header.volumes);
    facts.info.metadata.add_pairs(header.pairs_of_volumes);
    facts.volume_names = std::move(header.volume_names);
  }
  facts.files = {path};
  facts.rescale = header.rescale;
  facts.holds_other_bytes = true;  // the header says more than the file that is made
  for (const std::string& warning : header.warnings) facts.warnings.push_back(name + ": " + warning);
  for (const std::string& sentence : header.not_understood)
    facts.not_understood.push_back(name + ": " + sentence);
  if (!header.scale_doubt.empty()) facts.scale_doubt = name + ": " + header.scale_doubt;
  if (header.is_pair) {
    facts.files.push_back(image_path(path, name));
    require_inside(path, {facts.files.back()}, source.data_outside, facts.warnings);
    file = std::make_unique<FileBytes>(facts.files.back());
  }
  const bool is_last = !number || *number + 1 == header.volumes;
  SamplesPlace place{.start = 0, .big_endian = header.big_endian, .may_go_on = !is_last};
  if (begins_gzip(*file))
    return compressed_samples(std::move(facts), std::move(file), place, before,
                              header.is_pair ? plain_header(path) : PlainHeader());
  place.start = before;
  if (is_last) allow_more(*file, place, facts);
  return plain_samples(std::move(facts), std::move(file), place);
}

}  // namespace tagrid
