// Bytes that can be read in any order: a file, or an object of a caller of the library.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace tagrid {

/// Several threads may call all functions at once.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  virtual std::uint64_t size() const = 0;
  /// Fills `to` with the bytes from `position` on. Throws WorldError on failure. REQUIRES: position +
  /// to.size() <= size().
  virtual void read_at(std::uint64_t position, std::span<std::byte> to) const = 0;
  /// For messages; the path, for a file.
  virtual const std::string& name() const = 0;
};

/// A regular file: other files cannot be read in any order.
class FileSource : public ByteSource {
 public:
  /// Opens a file, or the standard input for "-", from its position on. Throws WorldError.
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
  std::uint64_t base_ = 0;  ///< position of the first byte; not 0 if the standard input was partly read
  std::uint64_t size_ = 0;
};

}  // namespace tagrid
