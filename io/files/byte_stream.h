// Bytes that are read in order: from a file, a pipe, or an object of a caller of the library.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "io/files/byte_source.h"

namespace tagrid {

/// Every failure to read is a WorldError that names the input.
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

}  // namespace tagrid
