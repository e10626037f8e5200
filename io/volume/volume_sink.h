// Where samples go: files of any format, or a pipe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "io/files/file_attributes.h"
#include "io/volume/volume_info.h"

namespace tagrid {

/// What the files of a volume are like, whatever their format.
struct SinkOptions {
  /// Older files give way; otherwise one is a UsageError.
  bool overwrite = false;
  /// Whose permissions and times the files get.
  std::optional<FileAttributes> like = std::nullopt;
  /// Other processes write the samples: see VolumeSink::place().
  bool others_write = false;
};

/// A volume that is written in raster order, or, with any_order(), in any order, and appears when it is
/// complete. Samples are of info().type in the machine's byte order, x fastest. All functions throw WorldError.
class VolumeSink {
 public:
  virtual ~VolumeSink() = default;
  VolumeSink(const VolumeSink&) = delete;
  VolumeSink& operator=(const VolumeSink&) = delete;

  const VolumeInfo& info() const { return info_; }

  /// Writes the next samples, in pieces of any whole number of them.
  void write_slices(std::span<const std::byte> samples) { write_samples(next_, samples); }
  /// Writes samples from number `first` on, in raster order. REQUIRES: they are the next ones, or any_order();
  /// none is written twice.
  void write_samples(std::int64_t first, std::span<const std::byte> samples);

  /// Whether samples can be written in any order.
  virtual bool any_order() const = 0;
  /// Where all samples lie, little endian.
  struct Place {
    std::string file;  ///< a temporary one, until publish()
    std::string name;  ///< what it will be called
    std::uint64_t start = 0;
  };
  /// For other processes that write all samples. REQUIRES: any_order(); SinkOptions::others_write.
  virtual Place place() const = 0;
  /// To be called once they have.
  void samples_were_placed() { bytes_left_ = 0; }

  /// Makes the files durable and gives them their names: all or none. Without keep() they lose them again.
  /// See OutputFile. REQUIRES: all samples were written.
  virtual void publish() = 0;
  virtual void keep() = 0;
  void commit() {
    publish();
    keep();
  }
  /// Bytes of all files so far, headers included.
  virtual std::uint64_t bytes_written() const = 0;

 protected:
  explicit VolumeSink(const VolumeInfo& info);
  /// Of samples that were not written yet.
  std::uint64_t bytes_left() const { return bytes_left_; }

 private:
  virtual void write(std::int64_t first, std::span<const std::byte> samples) = 0;

  VolumeInfo info_;
  std::int64_t next_ = 0;
  std::uint64_t bytes_left_;
};

}  // namespace tagrid
