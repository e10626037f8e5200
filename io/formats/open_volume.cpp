// Volumes are opened here, and read in volume_reader.cpp.
#include <fmt/format.h>

#include <filesystem>

#include "io/files/errors.h"
#include "io/files/system_call.h"
#include "io/formats/other_formats.h"
#include "io/formats/volume_reader.h"
#include "io/nrrd/geometry.h"
#include "io/nrrd/header.h"
#include "io/nrrd/line.h"

namespace tagrid {
namespace {

/// Deflate makes at most 1032 bytes of one.
constexpr std::uint64_t max_gzip_ratio = 1040;

std::string read_nrrd_header(FileBytes& file) {
  std::string text;
  for (std::size_t line_start = 0;; line_start = text.size()) {
    if (!file.read_line(text, max_nrrd_header_bytes - text.size()))
      throw BrokenInput(fmt::format("{}: the NRRD header does not end within {} bytes", file.name(),
                                    max_nrrd_header_bytes));
    const std::string_view line = std::string_view(text).substr(line_start);
    if (line.empty() || line == "\n" || line == "\r\n") return text;
  }
}

std::string described(const Index3& dims, SampleType type) {
  return fmt::format("{} x {} x {} {}", dims.x, dims.y, dims.z, name_of(type));
}

/// A header may come from anybody. What it names must be a file, not something that talks to this process or
/// waits for another: not the standard input (which is what "-" means to teem), no pipe, no device.
void require_plain_file(const std::string& header_name, const std::string& data_file,
                        const std::string& path) {
  const auto status = status_of(path);
  const bool plain =
      !status || S_ISREG(status->st_mode) || S_ISDIR(status->st_mode);  // others: open() says why
  if (data_file == "-" || !plain)
    throw BrokenInput(
        fmt::format("{}: NRRD header: data file: {}: must name a file, not a stream or a device", header_name,
                    tagrid::quoted(std::string_view(data_file))));
}

BrokenInput no_volume(FileBytes& file) {
  if (file.peek(1).empty()) return BrokenInput(file.name() + ": is empty, and no volume");
  const OtherFormat format = other_format(file.peek(other_formats_peek));
  if (!format.what.empty())
    return BrokenInput(fmt::format("{}: {}", file.name(), format.what), format.problem);
  return BrokenInput(file.name() + ": not an NRRD volume, nor an OpenVDB file", Problem::no_known_format);
}

std::string beside(const std::string& header_path, const std::string& data_file) {
  if (header_path == "-") return data_file;
  return (std::filesystem::path(header_path).parent_path() / data_file).string();
}

}  // namespace

VolumeReader open_volume(const std::string& path, const SourceDescription& source) {
  const std::optional<RawDescription>& raw = source.raw;
  VolumeReader reader;
  reader.file_ = std::make_unique<FileBytes>(path);
  reader.files_ = {path};
  const bool headerless = raw && raw->offset > 0;
  if (!headerless && begins_vdb(reader.file_->peek(8))) {
    reader.open_vdb(source);
    return reader;
  }
  if (!source.vdb_grid.empty())
    throw UsageError(reader.file_->name() + ": is no OpenVDB file", Problem::not_openvdb);
  if (!headerless && begins_nrrd(reader.file_->peek(9)))
    reader.open_nrrd(path, raw);
  else if (raw)
    reader.open_raw(*raw);
  else
    throw no_volume(*reader.file_);
  reader.check_size();
  return reader;
}

void VolumeReader::open_vdb(const SourceDescription& source) {
  if (source.raw) throw UsageError(file_->name() + ": is an OpenVDB file", Problem::openvdb_described);
  if (!file_->size())
    throw UsageError(file_->name() + ": an OpenVDB file cannot be read from a pipe; give the file");
  vdb_ = std::make_unique<VdbReader>(std::move(file_), source.vdb_grid);
  info_ = vdb_->info();
  // Which voxels are active, and whatever else is in the file.
  holds_other_bytes_ = true;
}

void VolumeReader::open_nrrd(const std::string& path, const std::optional<RawDescription>& raw) {
  const std::string header_name = file_->name();
  NrrdHeader header;
  const std::string text = read_nrrd_header(*file_);
  try {
    header = parse_nrrd_header(text);
  } catch (const BrokenInput& broken) {
    throw BrokenInput(header_name + ": " + broken.what());
  }
  info_ = header.info;
  big_endian_ = header.big_endian;
  if (raw) check_against(*raw, header, header_name);
  bool notes_after_header = false;
  if (!header.data_file.empty()) {
    detached_header_bytes_ = file_->position();
    notes_after_header = !file_->peek(1).empty();
    files_.push_back(beside(path, header.data_file));
    require_plain_file(header_name, header.data_file, files_.back());
    try {
      file_ = std::make_unique<FileBytes>(files_.back());
    } catch (const WorldError& error) {
      throw WorldError(fmt::format("{}; it is the data file that {} names", error.what(), header_name));
    }
  }
  holds_other_bytes_ = notes_after_header || header.line_skip != 0 || header.byte_skip != 0;
  go_to_samples(header);
}

/// What the caller says of an NRRD file must be what its header says.
void VolumeReader::check_against(const RawDescription& raw, const NrrdHeader& header,
                                 const std::string& name) const {
  const std::string both = fmt::format("{}: its NRRD header says {}, its description {}", name,
                                       described(info_.dims, info_.type), described(raw.dims, raw.type));
  if (raw.dims != info_.dims) throw BrokenInput(both);
  if (raw.type != info_.type) throw UsageError(both);
  if (raw.big_endian && size_of(info_.type) > 1 && *raw.big_endian != header.big_endian)
    throw UsageError(
        fmt::format("{}: its NRRD header says endian {}", name, header.big_endian ? "big" : "little"),
        Problem::endian_differs);
  if (raw.spacing && *raw.spacing != info_.geometry.spacing) {
    const auto& [x, y, z] = info_.geometry.spacing;
    if (!info_.geometry.has_spacing)
      throw UsageError(name + ": its NRRD header says no spacing", Problem::spacing_not_in_header);
    throw UsageError(fmt::format("{}: its NRRD header says the spacing {}, {}, {}", name, x, y, z),
                     Problem::spacing_differs);
  }
}

void VolumeReader::open_raw(const RawDescription& raw) {
  if (!sample_bytes(raw.dims, raw.type))
    throw UsageError(described(raw.dims, raw.type) +
                     ": sizes must be positive, and the volume below 2^62 bytes");
  headerless_ = true;
  info_.dims = raw.dims;
  info_.type = raw.type;
  if (raw.spacing) info_.nrrd_fields = spacings_line(*raw.spacing);
  info_.geometry = geometry_of(info_.nrrd_fields);
  big_endian_ = raw.big_endian.value_or(false);
  holds_other_bytes_ = raw.offset > 0;
  skip_to(raw.offset);
}

void VolumeReader::go_to_samples(const NrrdHeader& header) {
  for (std::int64_t i = 0; i < header.line_skip; ++i) {
    std::string line;
    if (!file_->read_line(line, max_nrrd_header_bytes) || line.empty())
      throw BrokenInput(fmt::format("{}: its header says to skip {} lines, which it does not have",
                                    file_->name(), header.line_skip));
  }
  if (header.encoding == NrrdHeader::Encoding::gzip) {
    start_ = file_->position();
    gzip_skip_ = static_cast<std::uint64_t>(header.byte_skip);
    gzip_ = std::make_unique<GzipBytes>(*file_);
    seek_slice(0);
  } else if (header.byte_skip >= 0) {
    skip_to(file_->position() + static_cast<std::uint64_t>(header.byte_skip));
  } else {
    if (!seekable())
      throw BrokenInput(file_->name() + ": byte skip -1 (samples at the end) cannot be read from a pipe");
    const std::uint64_t bytes = *sample_bytes(info_.dims, info_.type);
    if (*file_->size() - file_->position() >= bytes) skip_to(*file_->size() - bytes);
  }
}

/// Makes `position` the start of the samples.
void VolumeReader::skip_to(std::uint64_t position) {
  start_ = position;
  if (seekable()) {
    if (position <= *file_->size()) file_->seek(position);
    return;
  }
  file_->skip(position - file_->position());
  if (file_->position() != position)
    throw BrokenInput(
        fmt::format("{}: ends before byte {}, where the samples should begin", file_->name(), position));
}

/// For messages: how many bytes there should be, and why.
std::string VolumeReader::samples_expected() const {
  const std::string skipped = start_ > 0 ? fmt::format(" from byte {} on", start_) : "";
  return fmt::format("{} bytes of samples are expected{} ({})", *sample_bytes(info_.dims, info_.type),
                     skipped, described(info_.dims, info_.type));
}

/// Throws if a file cannot have the right size; of a pipe nothing is known yet.
void VolumeReader::check_size() const {
  if (!seekable()) return;
  const std::uint64_t expected = *sample_bytes(info_.dims, info_.type);
  const std::uint64_t size = *file_->size();
  const std::uint64_t present = size > start_ ? size - start_ : 0;
  if (gzip_ && (expected + gzip_skip_) / max_gzip_ratio > present)
    throw BrokenInput(fmt::format("{}: {}, which {} bytes of gzip cannot hold", file_->name(),
                                  samples_expected(), present));
  if (gzip_ || present == expected) return;
  // What was said of it is wrong, or it is another file than it was taken for.
  if (size == 0) throw BrokenInput(fmt::format("{}: is empty; {}", file_->name(), samples_expected()));
  const OtherFormat format = start_ == 0 ? other_format(file_->peek(other_formats_peek)) : OtherFormat{};
  throw BrokenInput(fmt::format("{}: {}, but {} are present{}{}", file_->name(), samples_expected(), present,
                                format.what.empty() ? "" : "; it ", format.what),
                    format.problem);
}

}  // namespace tagrid
