#include "io/vdb/bytes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cstring>

#include "io/files/errors.h"

namespace tagrid {

VdbBytes::VdbBytes(FileBytes& file) : file_(file), size_(file.size().value()), window_(window_size) {
  file_.seek(0);
}

void VdbBytes::fail(const std::string& what) const {
  throw BrokenInput(fmt::format("{}: OpenVDB file: near byte {}: {}", name(), position(), what));
}

const std::byte* VdbBytes::take(std::size_t size) {
  assert(size <= window_size);
  if (size > left()) fail("the file ends too soon");
  if (end_ - begin_ < size) {
    window_position_ += begin_;
    std::memmove(window_.data(), window_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
    end_ +=
        file_.read(window_.data() + end_, std::min(window_size - end_, std::max(size - end_, read_ahead_)));
    if (end_ < size) fail("the file ends too soon");
  }
  begin_ += size;
  return window_.data() + begin_ - size;
}

std::string VdbBytes::text(std::size_t limit) {
  const auto size = number<std::uint32_t>();
  if (size > left()) fail("the file ends too soon");
  if (size > limit) fail(fmt::format("a string has an impossible length of {} bytes", size));
  std::string text;
  while (text.size() < size) {
    const std::size_t part = std::min(size - text.size(), window_size);
    text.append(reinterpret_cast<const char*>(take(part)), part);
  }
  return text;
}

void VdbBytes::skip(std::uint64_t size) {
  if (size > left()) fail("the file ends too soon");
  seek(position() + size);
}

void VdbBytes::seek_to(std::uint64_t position, std::size_t size) {
  seek(position);
  read_ahead_ = size;
}

void VdbBytes::seek(std::uint64_t position) {
  read_ahead_ = window_size;
  if (position > size_) fail("a position is beyond the end of the file");
  if (position >= window_position_ && position <= window_position_ + end_) {
    begin_ = static_cast<std::size_t>(position - window_position_);
    return;
  }
  file_.seek(position);
  window_position_ = position;
  begin_ = end_ = 0;
}

void put_vdb_text(FieldWriter& out, std::string_view text) {
  out.put(static_cast<std::uint32_t>(text.size()));
  out.put_bytes(std::as_bytes(std::span(text.data(), text.size())));
}

}  // namespace tagrid
