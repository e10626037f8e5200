// Volumes from NRRD files (attached, detached, raw or gzip), headerless files, pipes of either, and OpenVDB
// files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/files/file_bytes.h"
#include "io/files/gzip_bytes.h"
#include "io/vdb/reader.h"
#include "io/volume/volume_info.h"
#include "stages/grid/box.h"

namespace tagrid {

struct NrrdHeader;

/// A volume that is read slice by slice, in z order. All functions throw BrokenInput and WorldError.
class VolumeReader {
 public:
  const VolumeInfo& info() const { return info_; }
  /// Samples in a slice: dims.x * dims.y.
  std::int64_t slice_samples() const { return info_.dims.x * info_.dims.y; }

  /// Reads the next `count` whole slices to `out`: samples of info().type in the machine's byte order, x
  /// fastest. REQUIRES: the volume has as many left.
  void read_slices(std::byte* out, std::int64_t count);
  /// Reads `rows`, whole rows of one slice: any of a file with random_access(), else those that come next.
  /// REQUIRES: as said.
  void read_rows(std::byte* out, const Box& rows);
  /// To be called after the last slice: throws BrokenInput if anything follows it.
  void finish();

  /// Whether slices can be read again: a file, not a pipe.
  bool seekable() const { return vdb_ || file_->size().has_value(); }
  /// Whether any rows can be read as fast as the next ones.
  bool random_access() const { return seekable() && !gzip_ && !vdb_; }
  /// Whether rows have to be all of a slice.
  bool whole_slices_only() const { return vdb_ != nullptr; }
  /// The number of the sample that comes next, in raster order.
  std::int64_t next_sample() const { return next_sample_; }
  /// Makes slice `z` the next one. Cheap unless the file is compressed. REQUIRES: seekable(), 0 <= z <=
  /// dims.z.
  void seek_slice(std::int64_t z);
  void rewind() { seek_slice(0); }
  /// Copies all samples into a nameless file in `folder` and reads from there from then on: random_access().
  /// REQUIRES: nothing was read, or rewind().
  void spool(const std::string& folder);

  /// What reading takes besides the slices that are asked for: of an OpenVDB file its index, the leaves of 8
  /// slices, and a slice or two.
  std::uint64_t memory() const { return vdb_ ? vdb_->memory() + slice_bytes() : 0; }

  /// See FileBytes.
  void stop_when(const std::atomic<bool>& stop) {
    if (file_) file_->stop_when(stop);
  }

  /// The files that it is in: its own, and that of the samples where the header is detached. "-" for the
  /// standard input.
  const std::vector<std::string>& files() const { return files_; }
  /// Whether the files hold more than a header and these samples: bytes that are skipped.
  bool holds_other_bytes() const { return holds_other_bytes_; }
  /// Whether somebody else had to say how the samples lie: nothing in the file did.
  bool headerless() const { return headerless_; }
  /// Bytes read so far, of all files, since the last rewind; of an OpenVDB file, all that it has.
  std::uint64_t bytes_read() const {
    if (vdb_) return vdb_->file_size();
    return detached_header_bytes_ + (spooled_bytes_ > 0 ? spooled_bytes_ : file_->position());
  }

 private:
  friend VolumeReader open_volume(const std::string& path, const SourceDescription& source);

  VolumeReader() = default;
  void open_nrrd(const std::string& path, const std::optional<RawDescription>& raw);
  void check_against(const RawDescription& raw, const NrrdHeader& header, const std::string& name) const;
  void open_vdb(const SourceDescription& source);
  void open_raw(const RawDescription& raw);
  void go_to_samples(const NrrdHeader& header);
  void skip_to(std::uint64_t position);
  void check_size() const;
  std::string samples_expected() const;
  std::uint64_t slice_bytes() const;
  void spool_slices(const std::string& folder);
  void read_samples(std::byte* out, std::uint64_t position, std::uint64_t count);
  std::size_t read_decoded(std::byte* out, std::size_t size);

  VolumeInfo info_;
  bool big_endian_ = false;
  std::unique_ptr<FileBytes> file_;  ///< None of an OpenVDB file.
  std::unique_ptr<GzipBytes> gzip_;
  std::unique_ptr<VdbReader> vdb_;
  /// Where the samples, or the gzip stream, begin in the file; and how much of the decompressed to skip.
  std::uint64_t start_ = 0, gzip_skip_ = 0;
  std::int64_t next_sample_ = 0;
  std::uint64_t spooled_bytes_ = 0;  ///< of the file that the samples came from, where they were spooled
  std::vector<std::string> files_;
  std::uint64_t detached_header_bytes_ = 0;
  bool holds_other_bytes_ = false;
  bool headerless_ = false;
};

/// Opens the volume at `path`, or on the standard input for "-". What begins as an NRRD file is read as one
/// (unless `source.raw` has an offset), and must then agree with what `raw` says, if given: another size is
/// BrokenInput, another type, spacing or order of bytes UsageError. What begins as an OpenVDB file is read as
/// one, and must be a file. Anything else needs `raw`. The sizes of files are checked at once.
VolumeReader open_volume(const std::string& path, const SourceDescription& source = {});

}  // namespace tagrid
