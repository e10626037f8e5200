// Volumes to NRRD files (attached or detached), files of samples alone, OpenVDB files, and pipes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "io/files/output_file.h"
#include "io/vdb/writer.h"
#include "io/volume/volume_info.h"

namespace tagrid {

enum class VolumeFormat {
  nrrd,  ///< Header and samples in one file.
  nhdr,  ///< The header, and a file of the same name with .raw for the samples.
  raw,   ///< The samples alone.
  vdb,   ///< A grid in an OpenVDB file.
};

/// How names of files of the format end: ".nrrd" and so on.
std::string_view ending_of(VolumeFormat format);
/// The format whose ending the name has.
std::optional<VolumeFormat> format_with_ending(const std::string& path);

/// The format that a file's name asks for: .nrrd, .nhdr, .raw or .vdb, and raw for "-". Throws UsageError for
/// others.
VolumeFormat format_from_name(const std::string& path);

/// A volume that is written in raster order, or in a file in any order, little endian, and appears when it is
/// complete. An OpenVDB file is written with the last sample.
class VolumeWriter {
 public:
  const VolumeInfo& info() const { return info_; }

  /// Writes the next samples: of info().type in the machine's byte order, x fastest, in pieces of any whole
  /// number of samples.
  void write_slices(std::span<const std::byte> samples);
  /// Writes samples from number `first` on, in raster order. REQUIRES: they are the next ones, or can_seek();
  /// none is written twice.
  void write_samples(std::int64_t first, std::span<const std::byte> samples);
  /// Other processes write all samples, little endian: into this file, from this byte on. Called once they
  /// have.
  const std::string& temporary() const { return samples_->temporary(); }
  std::uint64_t samples_start() const { return start_; }
  void samples_were_placed() { bytes_left_ = 0; }
  /// Whether samples can be written in any order: to a file, not to a pipe, nor as a grid of OpenVDB.
  bool can_seek() const { return !vdb_ && samples_->can_seek(); }
  /// Makes the files durable and gives them their names: all or none. Without keep() they lose them again.
  /// See OutputFile. REQUIRES: all samples were written.
  void publish();
  void keep();
  void commit() {
    publish();
    keep();
  }
  /// What the grid of an OpenVDB file has become; nothing for other files. REQUIRES: all samples were
  /// written.
  std::optional<VdbSummary> vdb() const;
  /// Bytes of all files so far, headers included.
  std::uint64_t bytes_written() const;

 private:
  friend VolumeWriter open_volume_writer(const std::string& path, VolumeFormat format, const VolumeInfo& info,
                                         bool overwrite, const std::optional<FileAttributes>& like,
                                         const VdbOptions& vdb, bool others_write);
  VolumeWriter() = default;

  VolumeInfo info_;
  std::unique_ptr<OutputFile> samples_;
  std::unique_ptr<OutputFile> header_;  ///< A detached one only.
  std::uint64_t start_ = 0;             ///< where the samples begin in their file
  std::unique_ptr<VdbWriter> vdb_;
  std::uint64_t bytes_left_ = 0;
};

/// Begins a volume at `path`, or on the standard output for "-", where there is no format nhdr.
/// Its files get the permissions and times of `like`, if given. Throws UsageError if a file exists and
/// `overwrite` is false, WorldError if it cannot be created.
VolumeWriter open_volume_writer(const std::string& path, VolumeFormat format, const VolumeInfo& info,
                                bool overwrite, const std::optional<FileAttributes>& like = std::nullopt,
                                const VdbOptions& vdb = {}, bool others_write = false);

/// The file that the samples of a volume at `path` are written to: beside a detached header, else `path`.
std::string samples_path(const std::string& path, VolumeFormat format);

}  // namespace tagrid
