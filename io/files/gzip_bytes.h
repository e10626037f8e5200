// The content of a gzip stream (RFC 1952), decompressed as it is read.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "io/files/file_bytes.h"

namespace tagrid {

/// Reads one or more gzip members, or a zlib stream (RFC 1950), from the position of `file` to its end.
class GzipBytes {
 public:
  /// `file` must outlive this.
  explicit GzipBytes(FileBytes& file);
  ~GzipBytes();

  /// Reads `size` bytes, or fewer at the end; returns their number. Throws BrokenInput if the stream is
  /// damaged, ends too soon, or is followed by something else.
  std::size_t read(std::byte* out, std::size_t size);
  /// Starts again after the file has been moved back to the first member.
  void restart();

 private:
  struct Stream;
  bool next_member();

  FileBytes& file_;
  std::unique_ptr<Stream> stream_;
};

/// True if the next bytes of a file begin a gzip stream. Does not move on.
bool begins_gzip(FileBytes& file);

/// The first `size` bytes, or fewer, of the content of the gzip stream with which the file goes on; what is damaged ends
/// it. Does not move on. REQUIRES: size <= 4096.
std::string beginning_of_gzip(FileBytes& file, std::size_t size);

}  // namespace tagrid
