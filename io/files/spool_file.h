// A nameless temporary file: what has to wait until something else is written, without memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace tagrid {

/// Bytes that are written, in order or at their place, and then read back. The file has no name from the
/// start, so nothing is left however the program ends. Every failure is a WorldError.
class SpoolFile {
 public:
  /// A file in the folder of `path`, or in the folder for temporary files for "-" and for devices.
  static SpoolFile beside(const std::string& path);
  /// A file in `folder`; `whose` is named where that fails.
  static SpoolFile in(const std::string& folder, const std::string& whose);
  SpoolFile(SpoolFile&& other) noexcept;
  ~SpoolFile();
  SpoolFile(const SpoolFile&) = delete;
  SpoolFile& operator=(const SpoolFile&) = delete;

  void write(std::span<const std::byte> bytes);
  /// Writes at a place of the file, which may leave a gap. REQUIRES: no write().
  void write_at(std::uint64_t position, std::span<const std::byte> bytes);
  /// Begins again with an empty file.
  void clear();
  /// Gives the file away: its descriptor, to be closed by the caller.
  int release();
  /// Bytes written so far, gaps included.
  std::uint64_t size() const { return size_; }
  /// Calls use(std::span<std::byte>) for all bytes, in order, part by part; `use` may change what it is
  /// given. REQUIRES: no write() after the first call, except after
  /// clear().
  template <class Use>
  void read_back(Use use) {
    for (std::uint64_t position = 0; position < size_;) {
      const std::span<std::byte> part = read_part(position);
      use(part);
      position += part.size();
    }
  }
  /// Reads bytes anywhere. REQUIRES: they were written; no write() after the first call.
  void read_at(std::uint64_t position, std::span<std::byte> to);

 private:
  SpoolFile(std::string folder, std::string name);
  [[noreturn]] void fail(const char* what, int error) const;
  void create();
  void write_all(std::uint64_t position, std::span<const std::byte> bytes);
  void flush();
  void begin_reading();
  std::size_t read_some(std::uint64_t position, std::span<std::byte> to) const;
  std::span<std::byte> read_part(std::uint64_t position);

  std::string name_;  ///< Of whom it is for, for messages.
  std::string folder_;
  int descriptor_ = -1;
  std::vector<std::byte> buffer_;  ///< What is not in the file yet; later, what was read.
  bool reading_ = false;
  std::uint64_t flushed_ = 0;  ///< bytes of write() that are in the file
  std::uint64_t size_ = 0;
};

}  // namespace tagrid
