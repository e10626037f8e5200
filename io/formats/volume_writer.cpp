#include "io/formats/volume_writer.h"

#include <bit>
#include <cassert>
#include <filesystem>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/files/errors.h"
#include "io/nrrd/header.h"
#include "io/nrrd/line.h"

namespace tagrid {

std::string_view ending_of(VolumeFormat format) {
  switch (format) {
    case VolumeFormat::nrrd:
      return ".nrrd";
    case VolumeFormat::nhdr:
      return ".nhdr";
    case VolumeFormat::vdb:
      return ".vdb";
    default:
      return ".raw";
  }
}

std::optional<VolumeFormat> format_with_ending(const std::string& path) {
  const std::string extension = lower_case(std::filesystem::path(path).extension().string());
  for (const VolumeFormat format :
       {VolumeFormat::nrrd, VolumeFormat::nhdr, VolumeFormat::raw, VolumeFormat::vdb})
    if (extension == ending_of(format)) return format;
  return std::nullopt;
}

VolumeFormat format_from_name(const std::string& path) {
  if (path == "-") return VolumeFormat::raw;
  if (const auto format = format_with_ending(path)) return *format;
  throw UsageError(
      path +
      ": the name of a volume must end in .nrrd (header and samples), .nhdr (header, samples in a "
      ".raw beside it), .raw (samples alone) or .vdb (OpenVDB)");
}

std::string samples_path(const std::string& path, VolumeFormat format) {
  return format == VolumeFormat::nhdr ? std::filesystem::path(path).replace_extension(".raw").string() : path;
}

namespace {

/// A header names the file of its samples in a line of text, without quotes: some names mean something else
/// there.
void require_name_in_header(const VolumeInfo& info, const std::string& data_file) {
  try {
    if (parse_nrrd_header(nrrd_header_text(info, data_file)).data_file == data_file) return;
  } catch (const BrokenInput&) {
    // Then it is not what a header can say.
  }
  throw UsageError(tagrid::quoted(data_file) +
                   ": a detached header cannot name such a file; choose another name");
}

}  // namespace

VolumeWriter open_volume_writer(const std::string& path, VolumeFormat format, const VolumeInfo& info,
                                bool overwrite, const std::optional<FileAttributes>& like,
                                const VdbOptions& vdb, bool others_write) {
  VolumeWriter writer;
  writer.info_ = info;
  writer.bytes_left_ = sample_bytes(info.dims, info.type).value();
  const OutputFileOptions options{.like = like, .others_write = others_write};
  if (format != VolumeFormat::nhdr) {
    writer.samples_ = std::make_unique<OutputFile>(path, overwrite, options);
    if (format == VolumeFormat::nrrd) writer.samples_->write(nrrd_header_text(info, {}));
    if (format == VolumeFormat::vdb) writer.vdb_ = std::make_unique<VdbWriter>(path, info, vdb);
    writer.start_ = writer.samples_->position();
    return writer;
  }
  if (path == "-") throw UsageError("a detached header (nhdr) needs a file name; choose nrrd or raw");
  const std::filesystem::path data = samples_path(path, format);
  if (data == std::filesystem::path(path))
    throw UsageError(path + ": a detached header cannot be named .raw");
  require_name_in_header(info, data.filename().string());
  writer.header_ = std::make_unique<OutputFile>(path, overwrite, OutputFileOptions{.like = like});
  writer.samples_ = std::make_unique<OutputFile>(data.string(), overwrite, options);
  writer.header_->write(nrrd_header_text(info, data.filename().string()));
  return writer;
}

void VolumeWriter::write_slices(std::span<const std::byte> samples) {
  write_samples(static_cast<std::int64_t>((samples_->position() - start_) / size_of(info_.type)), samples);
}

void VolumeWriter::write_samples(std::int64_t first, std::span<const std::byte> samples) {
  assert(samples.size() <= bytes_left_ && samples.size() % size_of(info_.type) == 0);
  bytes_left_ -= samples.size();
  if (vdb_) {
    vdb_->write(samples);
    if (bytes_left_ == 0) vdb_->finish(*samples_);
    return;
  }
  std::vector<std::byte> swapped;
  samples = little_endian_samples(samples, size_of(info_.type), swapped);
  const std::uint64_t place = start_ + static_cast<std::uint64_t>(first) * size_of(info_.type);
  if (place == samples_->position())
    samples_->write(samples);
  else
    samples_->write_at(place, samples);
}

std::optional<VdbSummary> VolumeWriter::vdb() const {
  return vdb_ ? std::optional(vdb_->summary()) : std::nullopt;
}

std::uint64_t VolumeWriter::bytes_written() const {
  if (vdb_) return samples_->position();
  return start_ + sample_bytes(info_.dims, info_.type).value() - bytes_left_ +
         (header_ ? header_->position() : 0);
}

void VolumeWriter::publish() {
  assert(bytes_left_ == 0);
  if (header_) header_->sync();
  // A header without samples would be taken for a volume, samples without a header are not.
  samples_->publish();
  if (!header_) return;
  try {
    header_->publish();
  } catch (...) {
    samples_.reset();
    throw;
  }
}

void VolumeWriter::keep() {
  // One whose older file cannot be removed must not lose the other its name.
  try {
    samples_->keep();
  } catch (...) {
    if (header_) header_->keep();
    throw;
  }
  if (header_) header_->keep();
}

}  // namespace tagrid
