#include "io/samples/file_sink.h"

#include <cassert>
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

}  // namespace tagrid
