#include "io/formats/volume_reader.h"

#include <fmt/format.h>

#include <bit>
#include <cassert>
#include <stdexcept>

#include "io/bytes/little_endian.h"
#include "io/files/errors.h"
#include "io/files/spool_file.h"

namespace tagrid {

std::uint64_t VolumeReader::slice_bytes() const {
  return static_cast<std::uint64_t>(slice_samples()) * size_of(info_.type);
}

std::size_t VolumeReader::read_decoded(std::byte* out, std::size_t size) {
  return gzip_ ? gzip_->read(out, size) : file_->read(out, size);
}

// The next `count` samples; `position` is the first one's in the volume.
void VolumeReader::read_samples(std::byte* out, std::uint64_t position, std::uint64_t count) {
  const std::size_t size = static_cast<std::size_t>(count) * size_of(info_.type);
  const std::size_t present = read_decoded(out, size);
  if (present != size)
    throw BrokenInput(fmt::format("{}: {}, but it ends after {}", file_->name(), samples_expected(),
                                  position * size_of(info_.type) + present));
  if (big_endian_ != (std::endian::native == std::endian::big))
    swap_bytes_of_samples(out, size / size_of(info_.type), size_of(info_.type));
}

void VolumeReader::read_slices(std::byte* out, std::int64_t count) {
  assert(count >= 0 && next_sample_ + count * slice_samples() <= Box::of_size(info_.dims).count());
  if (vdb_) {
    for (; count > 0; --count, next_sample_ += slice_samples(), out += slice_bytes())
      vdb_->read_slice(next_sample_ / slice_samples(), out);
    return;
  }
  read_samples(out, static_cast<std::uint64_t>(next_sample_),
               static_cast<std::uint64_t>(count * slice_samples()));
  next_sample_ += count * slice_samples();
}

void VolumeReader::read_rows(std::byte* out, const Box& rows) {
  const Box volume = Box::of_size(info_.dims);
  assert(volume.contains(rows) && rows.size().x == info_.dims.x && rows.size().z == 1);
  const std::int64_t first = volume.offset(rows.low);
  if (random_access()) {
    const std::uint64_t place = start_ + static_cast<std::uint64_t>(first) * size_of(info_.type);
    if (file_->position() != place) file_->seek(place);
  } else {
    assert(first == next_sample_);
    if (vdb_) {
      // More would be written than there is room for.
      if (rows.count() != slice_samples()) throw std::logic_error("rows of a slice of an OpenVDB file");
      return read_slices(out, 1);
    }
  }
  read_samples(out, static_cast<std::uint64_t>(first), static_cast<std::uint64_t>(rows.count()));
  next_sample_ = first + rows.count();
}

void VolumeReader::finish() {
  assert(next_sample_ == Box::of_size(info_.dims).count());
  if (vdb_) return;
  std::byte next;
  if (read_decoded(&next, 1) != 0)
    throw BrokenInput(fmt::format("{}: {}, but more are present", file_->name(), samples_expected()));
}

void VolumeReader::seek_slice(std::int64_t z) {
  assert(z >= 0 && z <= info_.dims.z);
  const std::uint64_t offset = static_cast<std::uint64_t>(z) * slice_bytes();
  next_sample_ = z * slice_samples();
  if (vdb_) return;
  if (!gzip_) return file_->seek(start_ + offset);
  if (seekable()) file_->seek(start_);
  gzip_->restart();
  std::byte skipped[4096];
  for (std::uint64_t left = gzip_skip_ + offset; left > 0;) {
    const std::size_t count = std::min<std::uint64_t>(left, sizeof skipped);
    if (read_decoded(skipped, count) != count)
      throw BrokenInput(fmt::format("{}: {}, but it ends before", file_->name(), samples_expected()));
    left -= count;
  }
}

void VolumeReader::spool(const std::string& folder) {
  assert(next_sample_ == 0);
  if (vdb_) return spool_slices(folder);
  SpoolFile spooled = SpoolFile::in(folder, file_->name());
  std::vector<std::byte> part(std::size_t{1} << 20);
  for (std::uint64_t left = *sample_bytes(info_.dims, info_.type), done = 0; left > 0;) {
    const std::size_t wanted = std::min<std::uint64_t>(left, part.size());
    const std::size_t count = read_decoded(part.data(), wanted);
    done += count;
    if (count != wanted)
      throw BrokenInput(fmt::format("{}: {}, but it ends after {}", file_->name(), samples_expected(), done));
    spooled.write(std::span(part).first(count));
    left -= count;
  }
  next_sample_ = Box::of_size(info_.dims).count();
  finish();
  spooled_bytes_ = file_->position();
  gzip_.reset();
  const std::string name = file_->name();
  file_ = std::make_unique<FileBytes>(spooled.release(), name);
  start_ = 0;
  next_sample_ = 0;
}

// The same of an OpenVDB file, whose slices are made one by one.
void VolumeReader::spool_slices(const std::string& folder) {
  SpoolFile spooled = SpoolFile::in(folder, files_.front());
  std::vector<std::byte> slice(static_cast<std::size_t>(slice_bytes()));
  for (std::int64_t z = 0; z < info_.dims.z; ++z) {
    vdb_->read_slice(z, slice.data());
    spooled.write(slice);
  }
  spooled_bytes_ = vdb_->file_size();
  vdb_.reset();
  file_ = std::make_unique<FileBytes>(spooled.release(), files_.front());
}

}  // namespace tagrid
