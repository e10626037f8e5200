// A nameless temporary file for data that must wait, outside memory, until other data is written.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/system/files.h"

namespace tagrid {

/// Bytes that are written, in order or at a position, and then read back. The file never has a name, so
/// nothing is left however the program ends. Every failure is a WorldError.
class SpoolFile {
 public:
  /// A file in the folder of `path`; for "-" and devices, in the folder for temporary files.
  static SpoolFile beside(const std::string& path);
  /// A file in `folder`; error messages name `whose`.
  static SpoolFile in(const std::string& folder, const std::string& whose);

  void write(std::span<const std::byte> bytes);
  /// Writes at a position of the file; this may leave a gap. read_at() may come before it. REQUIRES: no
  /// write() and no read_back().
  void write_at(std::uint64_t position, std::span<const std::byte> bytes);
  /// Starts again with an empty file.
  void clear();
  /// Gives the file away: returns its descriptor, which the caller must close.
  int release();
  /// Bytes written so far, including gaps.
  std::uint64_t size() const { return size_; }
  /// Calls use(std::span<std::byte>) for all bytes, in order, part by part; `use` may change the bytes that
  /// it gets. REQUIRES: no write() after the first call, except after clear().
  template <class Use>
  void read_back(Use use) {
    for (std::uint64_t position = 0; position < size_;) {
      const std::span<std::byte> part = read_part(position);
      use(part);
      position += part.size();
    }
  }
  /// Reads bytes anywhere. REQUIRES: they were written; no write(), but perhaps write_at(), follows.
  void read_at(std::uint64_t position, std::span<std::byte> to);

 private:
  SpoolFile(std::string folder, std::string name);
  [[noreturn]] void fail(const char* what, int error) const;
  void write_all(std::uint64_t position, std::span<const std::byte> bytes);
  void flush();
  void begin_reading();
  std::size_t read_some(std::uint64_t position, std::span<std::byte> to) const;
  std::span<std::byte> read_part(std::uint64_t position);

  std::string name_;  ///< For messages: the file for which this one is used.
  std::string folder_;
  Descriptor descriptor_;
  std::vector<std::byte> buffer_;  ///< Bytes that are not in the file yet; later, bytes that were read.
  bool reading_ = false;
  std::uint64_t flushed_ = 0;  ///< bytes of write() that are in the file
  std::uint64_t size_ = 0;
};

/// Calls use(first, bytes) for `count` entries of a spooled array, from entry `first` on, in order, in pieces of
/// complete entries with at most 1 MiB. `first` is then the number of the first entry of the piece.
template <class Use>
void for_each_piece(SpoolFile& array, std::size_t entry_bytes, std::int64_t first, std::int64_t count,
                    Use use) {
  constexpr std::size_t most = std::size_t{1} << 20;
  const auto entries = static_cast<std::int64_t>(most / entry_bytes);
  std::vector<std::byte> piece;
  for (const std::int64_t end = first + count; first < end;) {
    const std::int64_t n = std::min(entries, end - first);
    piece.resize(static_cast<std::size_t>(n) * entry_bytes);
    array.read_at(static_cast<std::uint64_t>(first) * entry_bytes, piece);
    use(first, std::span<const std::byte>(piece));
    first += n;
  }
}

/// The same for all entries.
template <class Use>
void for_each_piece(SpoolFile& array, std::size_t entry_bytes, Use use) {
  for_each_piece(array, entry_bytes, 0, static_cast<std::int64_t>(array.size() / entry_bytes), use);
}

/// What the file system of a folder has room for.
struct RoomForFiles {
  std::optional<std::uint64_t> bytes;  ///< nothing if that is not known
  bool is_in_memory = false;           ///< Files there use memory.
};
RoomForFiles room_in(const std::string& folder);

/// The folder for temporary files of an output: `spool`, or the folder of SpoolFile::beside(path).
std::string spool_folder(const std::optional<std::string>& spool, const std::string& path);

}  // namespace tagrid
