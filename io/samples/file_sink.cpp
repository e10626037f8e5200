#include "io/samples/file_sink.h"

#include <zlib.h>

#include <algorithm>
#include <cassert>
#include <new>
#include <utility>
#include <vector>

#include "io/bytes/little_endian.h"

namespace tagrid {

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
  const std::uint64_t place = start_ + static_cast<std::uint64_t>(first) * size;
  if (place == file_->position())
    file_->write(samples);
  else
    file_->write_at(place, samples);
}

std::uint64_t AttachedSink::bytes_written() const {
  return start_ + sample_bytes(info().dims, info().type).value() - bytes_left() + trailer_.size();
}

void AttachedSink::publish() {
  assert(bytes_left() == 0);
  const std::uint64_t end = start_ + sample_bytes(info().dims, info().type).value();
  if (!trailer_.empty() && file_->position() == end)
    file_->write(trailer_);
  else if (!trailer_.empty())
    file_->write_at(end, std::as_bytes(std::span(trailer_)));
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

struct GzipSink::Stream {
  z_stream z = {};
  std::vector<std::byte> output = std::vector<std::byte>(std::size_t{1} << 16);
};

GzipSink::GzipSink(const VolumeInfo& info, std::unique_ptr<OutputFile> file, std::string_view header)
    : VolumeSink(info), file_(std::move(file)), stream_(std::make_unique<Stream>()) {
  // Without a name and a time, so that equal volumes are equal files.
  if (deflateInit2(&stream_->z, Z_DEFAULT_COMPRESSION, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK)
    throw std::bad_alloc();
  deflate(std::as_bytes(std::span(header.data(), header.size())), false);
}

GzipSink::~GzipSink() { deflateEnd(&stream_->z); }

void GzipSink::write(std::int64_t, std::span<const std::byte> samples) {
  std::vector<std::byte> swapped;
  deflate(little_endian_samples(samples, size_of(info().type), swapped), false);
}

void GzipSink::deflate(std::span<const std::byte> bytes, bool is_last) {
  z_stream& z = stream_->z;
  do {
    const std::size_t part = std::min(bytes.size(), std::size_t{1} << 30);
    z.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(bytes.data()));  // zlib does not write there
    z.avail_in = static_cast<uInt>(part);
    bytes = bytes.subspan(part);
    int result = Z_OK;
    do {
      z.next_out = reinterpret_cast<Bytef*>(stream_->output.data());
      z.avail_out = static_cast<uInt>(stream_->output.size());
      result = ::deflate(&z, is_last && bytes.empty() ? Z_FINISH : Z_NO_FLUSH);
      file_->write(std::span(stream_->output).first(stream_->output.size() - z.avail_out));
    } while (z.avail_out == 0 && result != Z_STREAM_END);
  } while (!bytes.empty());
}

void GzipSink::publish() {
  assert(bytes_left() == 0);
  deflate({}, true);
  file_->publish();
}

}  // namespace tagrid
