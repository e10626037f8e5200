#include "io/files/spool_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <utility>

#include "io/errors/errors.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

constexpr std::size_t buffer_size = std::size_t{1} << 20;

}  // namespace

SpoolFile SpoolFile::in(const std::string& folder, const std::string& whose) { return {folder, whose}; }

SpoolFile::SpoolFile(std::string folder, std::string name)
    : name_(std::move(name)), folder_(std::move(folder)) {
  buffer_.reserve(buffer_size);
  descriptor_ = files().open_nameless(folder_);
  if (descriptor_ < 0) fail("cannot create", errno);
}

void SpoolFile::fail(const char* what, int error) const {
  throw world_error(fmt::format("{} a temporary file in {}", what, folder_), name_, error);
}

void SpoolFile::write(std::span<const std::byte> bytes) {
  assert(!reading_);
  size_ += bytes.size();
  while (!bytes.empty()) {
    const std::size_t count = std::min(bytes.size(), buffer_size - buffer_.size());
    buffer_.insert(buffer_.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count));
    bytes = bytes.subspan(count);
    if (buffer_.size() == buffer_size) flush();
  }
}

void SpoolFile::write_all(std::uint64_t position, std::span<const std::byte> bytes) {
  if (!files().write_at(descriptor_, position, bytes)) fail("cannot write", errno);
}

void SpoolFile::write_at(std::uint64_t position, std::span<const std::byte> bytes) {
  assert(buffer_.empty());
  write_all(position, bytes);
  size_ = std::max(size_, position + bytes.size());
  flushed_ = size_;
}

void SpoolFile::clear() {
  buffer_.clear();
  reading_ = false;
  size_ = flushed_ = 0;
}

RoomForFiles room_in(const std::string& folder) {
  Room room;
  if (!files().room(folder, room)) return {};
  return {room.bytes, room.is_in_memory};
}

int SpoolFile::release() {
  flush();
  return descriptor_.release();
}

void SpoolFile::flush() {
  write_all(flushed_, buffer_);
  flushed_ += buffer_.size();
  buffer_.clear();
}

void SpoolFile::begin_reading() {
  if (!reading_) flush();
  reading_ = true;
}

std::size_t SpoolFile::read_some(std::uint64_t position, std::span<std::byte> to) const {
  const std::ptrdiff_t count = files().read_at(descriptor_, position, to);
  if (count <= 0) fail("cannot read", count < 0 ? errno : EIO);
  return static_cast<std::size_t>(count);
}

void SpoolFile::read_at(std::uint64_t position, std::span<std::byte> to) {
  begin_reading();
  while (!to.empty()) {
    const std::size_t count = read_some(position, to);
    to = to.subspan(count);
    position += count;
  }
}

std::span<std::byte> SpoolFile::read_part(std::uint64_t position) {
  begin_reading();
  buffer_.resize(buffer_size);
  // Beyond the written bytes there may be bytes from before clear().
  const std::size_t wanted = std::min<std::uint64_t>(buffer_size, size_ - position);
  return std::span(buffer_).first(read_some(position, std::span(buffer_).first(wanted)));
}

}  // namespace tagrid
