// Destinations of samples: files of any format, or a pipe.
#pragma once

#include <array>
#include <atomic>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "io/files/file_attributes.h"
#include "io/volume/volume_info.h"

namespace tagrid {

/// Properties of a volume's files, in any format.
struct SinkOptions {
  /// Replaces existing files. Otherwise an existing file is a UsageError.
  bool overwrite = false;
  /// The permissions and times that the files get.
  std::optional<FileAttributes> like = std::nullopt;
  /// The folder for a temporary file, if a program writes to a pipe. If not given, the usual one.
  std::optional<std::string> spool = std::nullopt;
  /// Other processes write the samples; see VolumeSink::place().
  bool others_write = false;
};

/// A smaller copy of a volume: the means of blocks of `factor` samples along each axis.
struct MeansLevel {
  std::int64_t factor = 0;
  Index3 dims;
};

/// What is known of a volume besides its samples, for formats that say it.
struct KnownFacts {
  std::vector<MeansLevel> levels = {};              ///< that are written after the volume
  std::optional<double> max_error, achieved_error;  ///< the bound of each value, and what was measured
  std::optional<std::array<double, 2>> range;       ///< the smallest and the largest value
};

/// A volume that is written in raster order or, if any_order(), in any order. Its files appear when it is
/// complete. Samples have the type info().type and the machine's byte order, x fastest. All functions throw
/// WorldError.
class VolumeSink {
 public:
  virtual ~VolumeSink() = default;
  VolumeSink(const VolumeSink&) = delete;
  VolumeSink& operator=(const VolumeSink&) = delete;

  const VolumeInfo& info() const { return info_; }

  /// Writes the next samples. Each call may pass any whole number of samples.
  void write_slices(std::span<const std::byte> samples) { write_samples(next_, samples); }
  /// Writes samples from number `first` on, perhaps from several threads. REQUIRES: the next ones, or any_order();
  /// one thread at a time, or at_once(); none twice.
  void write_samples(std::int64_t first, std::span<const std::byte> samples) {
    const std::size_t size = size_of(info_.type);
    assert(samples.size() <= bytes_left_ && samples.size() % size == 0);
    bytes_left_ -= samples.size();
    write(first, samples);
    next_ = first + static_cast<std::int64_t>(samples.size() / size);
  }

  /// True if samples can be written in any order.
  virtual bool any_order() const { return false; }
  /// True if several threads can write samples at once. Implies any_order().
  virtual bool at_once() const { return false; }
  /// The place of all samples in a file, little endian.
  struct Place {
    std::string file;  ///< a temporary file, until publish()
    std::string name;  ///< its final name
    std::uint64_t start = 0;
  };
  /// For other processes, which write all samples. REQUIRES: any_order(); SinkOptions::others_write.
  virtual Place place() const { throw std::logic_error("these samples have no place in a file"); }
  /// To be called when the other processes have written all samples.
  void samples_were_placed() { bytes_left_ = 0; }

  /// Makes the files durable and gives them their names: either all of them or none. If keep() is not called
  /// afterwards, the names are removed again. See OutputFile. REQUIRES: all samples were written.
  virtual void publish() = 0;
  virtual void keep() = 0;
  void commit() {
    publish();
    keep();
  }
  /// The total size of all files so far, including headers.
  virtual std::uint64_t bytes_written() const = 0;

  /// Bytes of memory that a program takes which writes the files; 0 if there is none.
  virtual std::uint64_t memory() const { return 0; }
  /// What users should know of the files, a sentence each.
  virtual std::vector<std::string> warnings() const { return {}; }
  /// The level with this number in KnownFacts::levels, a volume in raster order. It belongs to this sink,
  /// which publishes it. REQUIRES: everything before it was written.
  virtual VolumeSink& level(std::size_t /*number*/) { throw std::logic_error("this format has no levels"); }
  /// What is to be said of the files: a JSON object, also that of the program that has written them; or "".
  virtual std::string facts() const { return ""; }

 protected:
  explicit VolumeSink(const VolumeInfo& info)
      : info_(info), bytes_left_(sample_bytes(info.dims, info.type).value()) {}
  /// Bytes of the samples that have not been written yet.
  std::uint64_t bytes_left() const { return bytes_left_; }

 private:
  virtual void write(std::int64_t first, std::span<const std::byte> samples) = 0;

  VolumeInfo info_;
  std::atomic<std::int64_t> next_ = 0;
  std::atomic<std::uint64_t> bytes_left_;
};

}  // namespace tagrid
