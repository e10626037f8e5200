// Bytes of an OpenVDB file, anywhere in it, of which none is trusted.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "io/bytes/byte_fields.h"
#include "io/files/file_bytes.h"

namespace tagrid {

/// Reads a file through a window. What would be past its end is BrokenInput.
class VdbBytes {
 public:
  /// `file` is a regular one, and outlives this.
  explicit VdbBytes(FileBytes& file);

  /// The next `size` bytes, until the next call. REQUIRES: size <= window_size.
  const std::byte* take(std::size_t size);
  template <class T>
  T number() {
    return load_little_endian<T>(take(sizeof(T)));
  }
  /// A string with its length before it, of no more than `limit` bytes.
  std::string text(std::size_t limit);

  std::uint64_t position() const { return window_position_ + begin_; }
  std::uint64_t left() const { return size_ - position(); }
  void skip(std::uint64_t size);
  void seek(std::uint64_t position);
  /// Moves to where `size` bytes are wanted, and reads no more than these.
  void seek_to(std::uint64_t position, std::size_t size);
  const std::string& name() const { return file_.name(); }

  /// Throws BrokenInput: the file, where it is broken, what is wrong.
  [[noreturn]] void fail(const std::string& what) const;

  static constexpr std::size_t window_size = std::size_t{1} << 20;

 private:
  FileBytes& file_;
  std::uint64_t size_;
  /// Bytes begin_ to end_ of the window are the next ones; its first one is at window_position_ of the file.
  std::vector<std::byte> window_;
  std::size_t begin_ = 0, end_ = 0;
  std::uint64_t window_position_ = 0;
  std::size_t read_ahead_ = window_size;  ///< How many bytes are read at once.
};

/// Writes a text as VdbBytes::text() reads it.
void put_vdb_text(FieldWriter& out, std::string_view text);

}  // namespace tagrid
