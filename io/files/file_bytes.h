// The bytes of a file or a pipe, in order.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/files/byte_stream.h"

namespace tagrid {

/// An open file or pipe. Every failure to read is a WorldError that names the file.
class FileBytes : public ByteStream {
 public:
  /// Opens a file, or standard input for "-".
  explicit FileBytes(const std::string& path);
  /// Takes an open regular file and starts at its beginning; `name` is for messages.
  FileBytes(int descriptor, const std::string& name);
  ~FileBytes() override;
  FileBytes(const FileBytes&) = delete;
  FileBytes& operator=(const FileBytes&) = delete;

  /// Reads `size` bytes, or fewer at the end; returns their number.
  std::size_t read(std::byte* out, std::size_t size) override;
  /// The next `size` bytes, or fewer at the end, without moving on. REQUIRES: size <= peek_limit.
  std::string_view peek(std::size_t size);
  /// Skips `size` bytes, or fewer at the end; returns their number.
  std::uint64_t skip(std::uint64_t size);
  /// Appends the next line, with its '\n', to `line`. Returns false if the line is longer than `limit` bytes.
  /// At the end of the file, nothing or a line without '\n' is appended.
  bool read_line(std::string& line, std::size_t limit);

  /// Size of a regular file; for standard input, from its position at the start.
  std::optional<std::uint64_t> size() const override { return size_; }
  /// Bytes read so far.
  std::uint64_t position() const override { return position_; }
  /// Moves to byte `position`. REQUIRES: size().
  void seek(std::uint64_t position);
  /// From now on, a read that waits for a pipe ends with a WorldError once `stop` is true, for callers that
  /// must be able to give up. `stop` must outlive the reads.
  void stop_when(const std::atomic<bool>& stop) override { stop_ = &stop; }
  /// For messages: the path, or "standard input".
  const std::string& name() const override { return name_; }

  static constexpr std::size_t peek_limit = std::size_t{1} << 16;

 private:
  void look_at_file();
  void wait_for_bytes() const;
  std::size_t read_once(std::byte* out, std::size_t size);
  void fill(std::size_t size);
  std::size_t buffered() const { return end_ - begin_; }

  std::string name_;
  int descriptor_ = -1;
  const std::atomic<bool>* stop_ = nullptr;
  std::optional<std::uint64_t> size_;
  std::uint64_t base_ = 0;
  std::uint64_t position_ = 0;
  /// Bytes begin_ to end_ of the buffer were read from the file, and not yet by the caller.
  std::vector<std::byte> buffer_;
  std::size_t begin_ = 0, end_ = 0;
};

}  // namespace tagrid
