// Bytes that are read in any order, wherever they are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>

namespace tagrid {

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

 private:
  std::shared_ptr<const ByteSource> source_;
  std::uint64_t position_, size_;
  std::string name_;
};

}  // namespace tagrid
