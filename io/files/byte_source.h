// Bytes that can be read in any order: a file, or whatever a caller of the library reads from.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace tagrid {

/// All functions may be called by several threads at once.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  virtual std::uint64_t size() const = 0;
  /// Fills `to` with the bytes from `position` on. Throws WorldError where that fails. REQUIRES: position +
  /// to.size() <= size().
  virtual void read_at(std::uint64_t position, std::span<std::byte> to) const = 0;
  /// For messages: the path of a file.
  virtual const std::string& name() const = 0;
};

/// A file, which must be a regular one: what cannot seek cannot be read in any order.
class FileSource : public ByteSource {
 public:
  /// Throws WorldError.
  explicit FileSource(const std::string& path);
  ~FileSource() override;
  FileSource(const FileSource&) = delete;
  FileSource& operator=(const FileSource&) = delete;

  std::uint64_t size() const override { return size_; }
  void read_at(std::uint64_t position, std::span<std::byte> to) const override;
  const std::string& name() const override { return name_; }

 private:
  std::string name_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

}  // namespace tagrid
