// Where samples come from: a file of any format, a pipe, or another source.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "io/volume/volume_info.h"
#include "stages/grid/box.h"

namespace tagrid {

/// How a source can be read.
struct SourceTraits {
  bool again = false;         ///< Any slice can become the next one, as often as wanted: a file, not a pipe.
  bool any_rows = false;      ///< Any rows can be read, not only the next ones; implies `again`.
  bool whole_slices = false;  ///< Samples can be read in whole slices only.
  std::uint64_t memory = 0;   ///< Bytes that reading takes besides the samples that are asked for.
};

/// What is known of a source before a sample is read.
struct SourceFacts {
  VolumeInfo info;
  /// The files that it is in: its own, and that of the samples where the header is detached. "-" for the
  /// standard input.
  std::vector<std::string> files;
  SourceTraits traits = {};
  /// The files hold more than a header and these samples: bytes that are skipped.
  bool holds_other_bytes = false;
  /// Somebody else had to say how the samples lie: nothing in the file did.
  bool headerless = false;
};

/// A volume that is read in raster order, or, where its traits allow, in any order. Samples are of info().type
/// in the machine's byte order, x fastest. All functions throw BrokenInput and WorldError.
class VolumeSource {
 public:
  virtual ~VolumeSource() = default;
  VolumeSource(const VolumeSource&) = delete;
  VolumeSource& operator=(const VolumeSource&) = delete;

  const SourceFacts& facts() const { return facts_; }
  const VolumeInfo& info() const { return facts_.info; }
  const SourceTraits& traits() const { return facts_.traits; }
  const std::vector<std::string>& files() const { return facts_.files; }
  /// For messages: the path of the file with the samples, or "standard input".
  std::string name() const { return files().back() == "-" ? "standard input" : files().back(); }

  /// Samples in a slice: dims.x * dims.y.
  std::int64_t slice_samples() const { return info().dims.x * info().dims.y; }
  std::uint64_t slice_bytes() const {
    return static_cast<std::uint64_t>(slice_samples()) * size_of(info().type);
  }
  /// The number of the sample that comes next, in raster order.
  std::int64_t next_sample() const { return next_sample_; }

  /// Reads the next `count` samples to `out`. REQUIRES: the volume has as many left; they are whole slices if
  /// traits().whole_slices.
  void read_samples(std::byte* out, std::int64_t count);
  void read_slices(std::byte* out, std::int64_t count) { read_samples(out, count * slice_samples()); }
  /// Reads `rows`, whole rows of one slice: any if traits().any_rows, else those that come next.
  void read_rows(std::byte* out, const Box& rows);
  /// Makes slice `z` the next one. REQUIRES: traits().again, 0 <= z <= dims.z.
  void seek_slice(std::int64_t z);
  void rewind() { seek_slice(0); }
  /// To be called after the last sample: throws BrokenInput if anything follows it.
  void finish();

  /// Bytes of all files that were read since the last rewind, or all that they have.
  virtual std::uint64_t bytes_read() const = 0;
  /// From now on a read that waits ends with a WorldError once `stop` is true. `stop` must outlive the reads.
  virtual void stop_when(const std::atomic<bool>& /*stop*/) {}

 protected:
  explicit VolumeSource(SourceFacts facts) : facts_(std::move(facts)) {}

 private:
  virtual void read(std::byte* out, std::int64_t first, std::int64_t count) = 0;
  virtual void seek(std::int64_t z) = 0;
  virtual void end() = 0;

  SourceFacts facts_;
  std::int64_t next_sample_ = 0;
};

/// Reads all samples that are left, a MiB or a slice at a time, and finishes.
void read_to_end(VolumeSource& source, const std::function<void(std::span<std::byte> samples)>& use);

}  // namespace tagrid
