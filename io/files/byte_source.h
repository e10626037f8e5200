// Bytes that are read in any order, wherever they are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tagrid {

/// Bytes from `begin` up to `end`, which is not one of them.
struct ByteRange {
  std::uint64_t begin = 0, end = 0;
  std::uint64_t size() const { return end - begin; }
};

/// Bytes that can be read in any order, by several threads: a file, or an object of a library's caller.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  virtual std::uint64_t size() const = 0;
  /// Fills `to` with bytes from `position` on. Throws WorldError. REQUIRES: position + to.size() <= size().
  virtual void read_at(std::uint64_t position, std::span<std::byte> to) const = 0;
  /// Called before memory is taken for bytes that are to be read: a source that lacks them may throw.
  virtual void expect(std::uint64_t /*position*/, std::uint64_t /*size*/) const {}
  /// For messages; the path, for a file.
  virtual const std::string& name() const = 0;
  /// True if each read costs a wait, so that it helps to say what will be read.
  virtual bool waits() const { return false; }
  /// What is read next, in any order; replaces what was said before. REQUIRES: the ranges are in the source.
  virtual void will_read(std::vector<ByteRange>) const {}
};

/// Bytes in memory, which must outlive it.
class BytesInMemory : public ByteSource {
 public:
  explicit BytesInMemory(std::span<const std::byte> bytes, std::string name = "bytes in memory")
      : bytes_(bytes), name_(std::move(name)) {}
  explicit BytesInMemory(std::string_view text)
      : BytesInMemory(std::as_bytes(std::span(text.data(), text.size())), "a text") {}

  std::uint64_t size() const override { return bytes_.size(); }
  void read_at(std::uint64_t position, std::span<std::byte> to) const override {
    if (!to.empty()) std::memcpy(to.data(), bytes_.data() + position, to.size());
  }
  const std::string& name() const override { return name_; }

 private:
  std::span<const std::byte> bytes_;
  std::string name_;
};

/// A part of a source.
class PartOfSource : public ByteSource {
 public:
  /// `name` is for messages. REQUIRES: position + size <= source->size().
  PartOfSource(std::shared_ptr<const ByteSource> source, std::uint64_t position, std::uint64_t size,
               std::string name)
      : source_(std::move(source)), position_(position), size_(size), name_(std::move(name)) {}

  std::uint64_t size() const override { return size_; }
  void read_at(std::uint64_t position, std::span<std::byte> to) const override {
    source_->read_at(position_ + position, to);
  }
  void expect(std::uint64_t position, std::uint64_t size) const override {
    source_->expect(position_ + position, size);
  }
  const std::string& name() const override { return name_; }
  bool waits() const override { return source_->waits(); }
  void will_read(std::vector<ByteRange> ranges) const override {
    for (ByteRange& range : ranges) range = {position_ + range.begin, position_ + range.end};
    source_->will_read(std::move(ranges));
  }

 private:
  std::shared_ptr<const ByteSource> source_;
  std::uint64_t position_, size_;
  std::string name_;
};

}  // namespace tagrid
