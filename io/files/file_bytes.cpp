#include "io/files/file_bytes.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <cstring>

#include "io/bytes/checksum.h"
#include "io/errors/errors.h"
#include "io/system/files.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

/// The bytes of a file from its position on.
struct Extent {
  std::uint64_t base, size;
};

[[noreturn]] void throw_cannot_open(const std::string& path, int error) {
  if (error == ENOENT && is_dead_link(path)) throw dead_link(path);
  throw world_error("cannot open", shown_input(path), error);
}

/// Throws WorldError for a directory. Returns nothing if the file is not a regular one.
std::optional<Extent> extent_of(int file, const std::string& name) {
  FileStatus status;
  std::int64_t base = 0;
  int error = files().status(file, status) ? 0 : errno;
  if (error == 0 && status.is_folder()) error = EISDIR;
  if (error == 0 && status.is_file() && (base = files().position(file)) < 0) error = errno;
  if (error != 0) throw world_error("cannot read", name, error);
  if (!status.is_file()) return std::nullopt;
  const auto from = static_cast<std::uint64_t>(base);
  return Extent{from, status.size - std::min(status.size, from)};
}

/// Reads `size` bytes, or fewer at the end of the file; returns their number.
std::size_t read_from(int file, const std::string& name, std::uint64_t position, std::byte* out,
                      std::size_t size) {
  std::size_t done = 0;
  while (done < size) {
    const std::ptrdiff_t count = files().read_at(file, position + done, {out + done, size - done});
    if (count < 0) throw world_error("cannot read", name, errno);
    if (count == 0) break;
    done += static_cast<std::size_t>(count);
  }
  return done;
}

}  // namespace

FileBytes::FileBytes(const std::string& path) : name_(shown_input(path)), buffer_(peek_limit) {
  if (path != "-") opened_ = files().open(path, {.read = true});
  descriptor_ = path == "-" ? standard_input : int{opened_};
  if (descriptor_ < 0) throw_cannot_open(path, errno);
  look_at_file();
}

FileBytes::FileBytes(int descriptor, const std::string& name)
    : name_(name), opened_(descriptor), descriptor_(descriptor), buffer_(peek_limit) {
  files().seek(descriptor_, 0);
  look_at_file();
}

void FileBytes::look_at_file() {
  const auto extent = extent_of(descriptor_, name_);
  if (!extent) return;
  base_ = extent->base;
  size_ = extent->size;
  files().reads_in_order(descriptor_);
}

/// Waits until a pipe has bytes, or has ended.
void FileBytes::wait_for_bytes() const {
  constexpr int look_again = 100;  // ms
  std::array<Awaited, 1> bytes = {{{descriptor_}}};
  while (wait_for(bytes, stop_ ? look_again : -1) == 0)
    if (*stop_) throw WorldError(name_ + ": its samples are no longer needed");
}

std::size_t FileBytes::read_once(std::byte* out, std::size_t size) {
  for (;;) {
    if (!size_) wait_for_bytes();
    const std::ptrdiff_t count = files().read(descriptor_, {out, size});
    if (count >= 0) return static_cast<std::size_t>(count);
    if (errno != EAGAIN) throw world_error("cannot read", name_, errno);
  }
}

void FileBytes::fill(std::size_t size) {
  assert(size <= peek_limit);
  if (buffered() >= size) return;
  std::memmove(buffer_.data(), buffer_.data() + begin_, buffered());
  end_ = buffered();
  begin_ = 0;
  while (end_ < size) {
    const std::size_t count = read_once(buffer_.data() + end_, buffer_.size() - end_);
    if (count == 0) return;
    end_ += count;
  }
}

std::size_t FileBytes::read(std::byte* out, std::size_t size) {
  std::size_t done = std::min(size, buffered());
  if (done > 0) std::memcpy(out, buffer_.data() + begin_, done);
  begin_ += done;
  while (done < size) {
    const std::size_t count = read_once(out + done, size - done);
    if (count == 0) break;
    done += count;
  }
  position_ += done;
  return done;
}

std::string_view FileBytes::peek(std::size_t size) {
  fill(size);
  return {reinterpret_cast<const char*>(buffer_.data() + begin_), std::min(size, buffered())};
}

std::uint64_t FileBytes::skip(std::uint64_t size) {
  std::uint64_t done = 0;
  while (done < size) {
    fill(1);
    if (buffered() == 0) break;
    const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(size - done, buffered()));
    begin_ += count;
    done += count;
  }
  position_ += done;
  return done;
}

bool FileBytes::read_line(std::string& line, std::size_t limit) {
  for (;;) {
    fill(1);
    if (buffered() == 0) return true;
    const char* bytes = reinterpret_cast<const char*>(buffer_.data() + begin_);
    const void* line_end = std::memchr(bytes, '\n', buffered());
    const std::size_t count =
        line_end ? static_cast<std::size_t>(static_cast<const char*>(line_end) - bytes) + 1 : buffered();
    if (count > limit) return false;
    line.append(bytes, count);
    limit -= count;
    begin_ += count;
    position_ += count;
    if (line_end) return true;
  }
}

std::size_t FileBytes::read_at(std::uint64_t position, std::byte* out, std::size_t size) const {
  assert(size_);
  return read_from(descriptor_, name_, base_ + position, out, size);
}

void FileBytes::seek(std::uint64_t position) {
  assert(size_);
  if (!files().seek(descriptor_, base_ + position)) throw world_error("cannot seek in", name_, errno);
  begin_ = end_ = 0;
  position_ = position;
}

FileSource::FileSource(const std::string& path) : name_(shown_input(path)) {
  // Opening a pipe must not wait for a writer, as a pipe is refused anyway.
  descriptor_ =
      path == "-" ? files().duplicate(standard_input) : files().open(path, {.read = true, .waits = false});
  if (descriptor_ < 0) throw_cannot_open(path, errno);
  const auto extent = extent_of(descriptor_, name_);
  if (!extent)
    throw WorldError(
        name_ +
        ": is not a regular file, and only regular files can be read in any order; copy it to a file first");
  base_ = extent->base;
  size_ = extent->size;
}

void FileSource::read_at(std::uint64_t position, std::span<std::byte> to) const {
  if (read_from(descriptor_, name_, base_ + position, to.data(), to.size()) != to.size())
    throw WorldError(name_ + ": became shorter while it was being read");
}

std::uint64_t checksum_of_file(const std::string& path) {
  FileBytes file(path);
  RunningChecksum checksum;
  std::vector<std::byte> bytes(std::size_t{1} << 20);
  for (;;) {
    const std::size_t count = file.read(bytes.data(), bytes.size());
    checksum.add({bytes.data(), count});
    if (count < bytes.size()) return checksum.value();
  }
}

}  // namespace tagrid
