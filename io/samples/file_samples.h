// Samples that lie in a file or a pipe one after the other: as they are, or in gzip.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "io/files/errors.h"
#include "io/files/file_bytes.h"
#include "io/files/gzip_bytes.h"
#include "io/volume/volume_source.h"

namespace tagrid {

/// The size of a file is not that of its samples: it may be another file than it was taken for.
class WrongSize : public BrokenInput {
 public:
  WrongSize(const std::string& message, std::string_view bytes) : BrokenInput(message), beginning(bytes) {}

  std::string beginning;  ///< Of the file; "" where samples do not begin there.
};

/// Where samples lie, and how.
struct SamplesPlace {
  std::uint64_t start = 0;  ///< The byte of their file where they begin, or the gzip stream that they are in.
  bool big_endian = false;
  std::uint64_t header_bytes = 0;  ///< Read before, of another file: a detached header.
};

/// What both kinds have in common.
class FileSamples : public VolumeSource {
 public:
  std::uint64_t bytes_read() const override { return place_.header_bytes + file_->position(); }
  void stop_when(const std::atomic<bool>& stop) override { file_->stop_when(stop); }

 protected:
  /// `any_rows`: of a file, not of a pipe.
  FileSamples(SourceFacts facts, std::unique_ptr<FileBytes> file, const SamplesPlace& place, bool any_rows);
  /// The next bytes of samples, less only at their end.
  virtual std::size_t read_bytes(std::byte* out, std::size_t size) = 0;
  /// For messages: how many bytes there should be, and why.
  std::string expected() const;
  std::uint64_t expected_bytes() const { return *sample_bytes(info().dims, info().type); }
  /// Bytes of the file from `start` on. REQUIRES: the file has a size.
  std::uint64_t present_bytes() const;

  const SamplesPlace place_;
  const std::unique_ptr<FileBytes> file_;

 private:
  void read(std::byte* out, std::int64_t first, std::int64_t count) final;
  void end() final;
};

/// Samples as they are. The constructor throws WrongSize where a file has more or less than them from `start`
/// on, and BrokenInput where a pipe ends before.
class PlainSamples : public FileSamples {
 public:
  PlainSamples(SourceFacts facts, std::unique_ptr<FileBytes> file, const SamplesPlace& place);

 private:
  std::size_t read_bytes(std::byte* out, std::size_t size) override { return file_->read(out, size); }
  void seek(std::int64_t z) override;
};

/// Samples in a gzip stream that reaches to the end of the file, after `skipped` decompressed bytes. The
/// constructor throws BrokenInput where the file is too small for them.
class GzipSamples final : public FileSamples {
 public:
  GzipSamples(SourceFacts facts, std::unique_ptr<FileBytes> file, const SamplesPlace& place,
              std::uint64_t skipped);

 private:
  std::size_t read_bytes(std::byte* out, std::size_t size) override { return gzip_.read(out, size); }
  void seek(std::int64_t z) override;

  GzipBytes gzip_;
  std::uint64_t skipped_;
};

}  // namespace tagrid
