// Writes samples in gzip.
#pragma once

#include <memory>
#include <string_view>

#include "io/files/output_file.h"
#include "io/volume/volume_sink.h"

namespace tagrid {

/// A header, and the samples in order, little endian, all of it as one gzip stream.
class GzipSink final : public VolumeSink {
 public:
  GzipSink(const VolumeInfo& info, std::unique_ptr<OutputFile> file, std::string_view header);
  ~GzipSink() override;

  bool any_order() const override { return false; }
  Place place() const override;
  void publish() override;
  void keep() override { file_->keep(); }
  std::uint64_t bytes_written() const override { return file_->position(); }

 private:
  struct Stream;
  void write(std::int64_t first, std::span<const std::byte> samples) override;
  void deflate(std::span<const std::byte> bytes, bool is_last);

  std::unique_ptr<OutputFile> file_;
  std::unique_ptr<Stream> stream_;
};

}  // namespace tagrid
