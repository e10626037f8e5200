// Bytes that are read: in any order or in sequence, from files or other sources.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/files/byte_source.h"
#include "io/system/files.h"

namespace tagrid {

/// Bytes that are read in order: from a file, a pipe, or an object of a caller of the library. Every failure
/// to read is a WorldError that names the input.
class ByteStream {
 public:
  virtual ~ByteStream() = default;
  /// Reads `size` bytes, or fewer at the end; returns their number.
  virtual std::size_t read(std::byte* out, std::size_t size) = 0;
  /// Bytes in all, if they are known.
  virtual std::optional<std::uint64_t> size() const = 0;
  /// Bytes read so far.
  virtual std::uint64_t position() const = 0;
  /// From now on a read that waits ends with a WorldError once `stop` is true. `stop` must outlive the reads.
  virtual void stop_when(const std::atomic<bool>& stop) = 0;
  /// For messages.
  virtual const std::string& name() const = 0;
};

/// A regular file: other files cannot be read in any order.
class FileSource : public ByteSource {
 public:
  /// Opens a file, or the standard input for "-", from its position on. Throws WorldError, and
  /// BrokenInput for a broken symbolic link.
  explicit FileSource(const std::string& path);

  std::uint64_t size() const override { return size_; }
  void read_at(std::uint64_t position, std::span<std::byte> to) const override;
  const std::string& name() const override { return name_; }

 private:
  std::string name_;
  Descriptor descriptor_;
  std::uint64_t base_ = 0;  ///< position of the first byte; not 0 if the standard input was partly read
  std::uint64_t size_ = 0;
};

/// A source, read in order.
class SourceStream : public ByteStream {
 public:
  explicit SourceStream(std::shared_ptr<const ByteSource> source) : source_(std::move(source)) {}

  std::size_t read(std::byte* out, std::size_t size) override {
    const std::size_t count = std::min<std::uint64_t>(size, source_->size() - position_);
    source_->read_at(position_, {out, count});
    position_ += count;
    return count;
  }
  std::optional<std::uint64_t> size() const override { return source_->size(); }
  std::uint64_t position() const override { return position_; }
  void stop_when(const std::atomic<bool>&) override {}  // it does not wait
  const std::string& name() const override { return source_->name(); }

 private:
  std::shared_ptr<const ByteSource> source_;
  std::uint64_t position_ = 0;
};

/// An open file or pipe. Every failure to read is a WorldError that names the file.
class FileBytes : public ByteStream {
 public:
  /// Opens a file, or standard input for "-". Throws BrokenInput for a broken symbolic link.
  explicit FileBytes(const std::string& path);
  /// Takes an open regular file and starts at its beginning; `name` is for messages.
  FileBytes(int descriptor, const std::string& name);

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
  /// Reads `size` bytes from byte `position` on, or fewer at the end, and does not move; returns their number.
  /// Several threads may do so at once. REQUIRES: size().
  std::size_t read_at(std::uint64_t position, std::byte* out, std::size_t size) const;
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
  Descriptor opened_;  ///< none for the standard input, which stays open
  int descriptor_ = -1;
  const std::atomic<bool>* stop_ = nullptr;
  std::optional<std::uint64_t> size_;
  std::uint64_t base_ = 0;
  std::uint64_t position_ = 0;
  /// Bytes begin_ to end_ of the buffer were read from the file, and not yet by the caller.
  std::vector<std::byte> buffer_;
  std::size_t begin_ = 0, end_ = 0;
};

/// The checksum of a file, as `xxhsum -H3` prints it. Throws WorldError.
std::uint64_t checksum_of_file(const std::string& path);

}  // namespace tagrid
