// Writes samples to a file or a pipe in order, little endian, uncompressed or in gzip.
#pragma once

#include <memory>
#include <string_view>

#include "io/files/output_file.h"
#include "io/volume/volume_sink.h"

namespace tagrid {

/// The options with which the files of a volume are created.
OutputFileOptions output_options(const SinkOptions& options);

/// A file with a header, if there is one, followed by the samples, and by a trailer, if there is one.
class AttachedSink : public VolumeSink {
 public:
  AttachedSink(const VolumeInfo& info, std::unique_ptr<OutputFile> file, std::string_view header = "",
               std::string trailer = "");

  bool any_order() const override { return file_->can_seek(); }
  bool at_once() const override { return any_order(); }
  Place place() const override { return {file_->temporary(), file_->name(), start_}; }
  void publish() override;
  void keep() override { file_->keep(); }
  std::uint64_t bytes_written() const override;

 protected:
  std::unique_ptr<OutputFile> file_;

 private:
  void write(std::int64_t first, std::span<const std::byte> samples) final;

  std::uint64_t start_;
  std::string trailer_;
};

/// A file of samples, and a separate file for the header.
class DetachedSink final : public AttachedSink {
 public:
  DetachedSink(const VolumeInfo& info, std::unique_ptr<OutputFile> header_file,
               std::unique_ptr<OutputFile> samples_file, std::string_view header);

  void publish() override;
  void keep() override;
  std::uint64_t bytes_written() const override;

 private:
  std::unique_ptr<OutputFile> header_;
};

/// A header, and the samples in order, little endian, all of it as one gzip stream.
std::unique_ptr<VolumeSink> gzip_sink(const VolumeInfo& info, std::unique_ptr<OutputFile> file,
                                      std::string_view header);

}  // namespace tagrid
