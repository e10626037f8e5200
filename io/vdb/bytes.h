// Bytes of an OpenVDB file, at any position. None of them is trusted.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "io/bytes/byte_fields.h"
#include "io/files/file_bytes.h"

namespace tagrid {

/// Reads a file through a window. Reading past the end of the file throws BrokenInput.
class VdbBytes {
 public:
  /// REQUIRES: `file` is a regular file and outlives this.
  explicit VdbBytes(FileBytes& file);

  /// Returns the next `size` bytes, valid until the next call. REQUIRES: size <= window_size.
  const std::byte* take(std::size_t size);
  template <class T>
  T number() {
    return load_little_endian<T>(take(sizeof(T)));
  }
  /// Reads a string that follows its length, of at most `limit` bytes.
  std::string text(std::size_t limit);

  std::uint64_t position() const { return window_position_ + begin_; }
  std::uint64_t left() const { return size_ - position(); }
  void skip(std::uint64_t size);
  void seek(std::uint64_t position);
  /// Moves to a position where `size` bytes are needed, and reads no more than these.
  void seek_to(std::uint64_t position, std::size_t size);
  const std::string& name() const { return file_.name(); }

  /// Throws BrokenInput that names the file, the position, and what is wrong.
  [[noreturn]] void fail(const std::string& what) const;

  static constexpr std::size_t window_size = std::size_t{1} << 20;

 private:
  FileBytes& file_;
  std::uint64_t size_;
  /// Bytes begin_ to end_ of the window are the next ones; its first byte is at window_position_ of the file.
  std::vector<std::byte> window_;
  std::size_t begin_ = 0, end_ = 0;
  std::uint64_t window_position_ = 0;
  std::size_t read_ahead_ = window_size;  ///< Number of bytes to read at once.
};

/// Writes a text in the form that VdbBytes::text() reads.
void put_vdb_text(FieldWriter& out, std::string_view text);

}  // namespace tagrid
