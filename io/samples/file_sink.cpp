#include "io/samples/file_sink.h"

#include <zlib.h>

#include <algorithm>
#include <cassert>
#include <new>
#include <utility>
#include <vector>

#include "io/bytes/little_endian.h"

namespace tagrid {
namespace {

class GzipSink final : public VolumeSink {
 public:
  GzipSink(const VolumeInfo& info, std::unique_ptr<OutputFile> file, std::string_view header)
      : VolumeSink(info), file_(std::move(file)), output_(std::size_t{1} << 16) {
    // Without a name and a time, and as on Unix, so that equal volumes are equal files.
    header_.os = 3;
    if (deflateInit2(&z_, Z_DEFAULT_COMPRESSION, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK ||
        deflateSetHeader(&z_, &header_) != Z_OK)
      throw std::bad_alloc();
    compress(std::as_bytes(std::span(header)), false);
  }
  ~GzipSink() override { deflateEnd(&z_); }

  void publish() override {
    assert(bytes_left() == 0);
    compress({}, true);
    file_->publish();
  }
  void keep() override { file_->keep(); }
  std::uint64_t bytes_written() const override { return file_->position(); }

 private:
  void write(std::int64_t, std::span<const std::byte> samples) override {
    std::vector<std::byte> swapped;
    compress(little_endian_samples(samples, size_of(info().type), swapped), false);
  }

  void compress(std::span<const std::byte> bytes, bool is_last) {
    do {
      const std::size_t part = std::min(bytes.size(), std::size_t{1} << 30);
      z_.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(bytes.data()));
      z_.avail_in = static_cast<uInt>(part);
      bytes = bytes.subspan(part);
      int result = Z_OK;
      do {
        z_.next_out = reinterpret_cast<Bytef*>(output_.data());
        z_.avail_out = static_cast<uInt>(output_.size());
        result = deflate(&z_, is_last && bytes.empty() ? Z_FINISH : Z_NO_FLUSH);
        file_->write(std::span(output_).first(output_.size() - z_.avail_out));
      } while (z_.avail_out == 0 && result != Z_STREAM_END);
    } while (!bytes.empty());
  }

  std::unique_ptr<OutputFile> file_;
  z_stream z_ = {};
  gz_header header_ = {};
  std::vector<std::byte> output_;
};

}  // namespace

OutputFileOptions output_options(const SinkOptions& options) {
  return {.like = options.like, .others_write = options.others_write};
}

AttachedSink::AttachedSink(const VolumeInfo& info, std::unique_ptr<OutputFile> file, std::string_view header,
                           std::string trailer)
    : VolumeSink(info), file_(std::move(file)), trailer_(std::move(trailer)) {
  if (!header.empty()) file_->write(header);
  start_ = file_->position();
}

void AttachedSink::write(std::int64_t first, std::span<const std::byte> samples) {
  const std::size_t size = size_of(info().type);
  std::vector<std::byte> swapped;
  samples = little_endian_samples(samples, size, swapped);
  if (file_->can_seek())
    file_->write_at(start_ + static_cast<std::uint64_t>(first) * size, samples);
  else
    file_->write(samples);
}

std::uint64_t AttachedSink::bytes_written() const {
  return start_ + sample_bytes(info().dims, info().type).value() - bytes_left() + trailer_.size();
}

void AttachedSink::publish() {
  assert(bytes_left() == 0);
  if (!trailer_.empty() && file_->can_seek())
    file_->write_at(start_ + sample_bytes(info().dims, info().type).value(),
                    std::as_bytes(std::span(trailer_)));
  else if (!trailer_.empty())
    file_->write(trailer_);
  file_->publish();
}

DetachedSink::DetachedSink(const VolumeInfo& info, std::unique_ptr<OutputFile> header_file,
                           std::unique_ptr<OutputFile> samples_file, std::string_view header)
    : AttachedSink(info, std::move(samples_file)), header_(std::move(header_file)) {
  header_->write(header);
}

std::uint64_t DetachedSink::bytes_written() const {
  return AttachedSink::bytes_written() + header_->position();
}

void DetachedSink::publish() {
  header_->sync();
  // The samples get their name first: a header without samples would be mistaken for a volume.
  AttachedSink::publish();
  try {
    header_->publish();
  } catch (...) {
    file_.reset();
    throw;
  }
}

void DetachedSink::keep() {
  // If an older file cannot be removed, the other file must still keep its name.
  try {
    AttachedSink::keep();
  } catch (...) {
    header_->keep();
    throw;
  }
  header_->keep();
}

std::unique_ptr<VolumeSink> gzip_sink(const VolumeInfo& info, std::unique_ptr<OutputFile> file,
                                      std::string_view header) {
  return std::make_unique<GzipSink>(info, std::move(file), header);
}

}  // namespace tagrid
