// The content of a gzip stream (RFC 1952), decompressed as it is read.
#pragma once

#include <cstddef>
#include <memory>

#include "io/files/file_bytes.h"

namespace tagrid {

/// Reads one or more gzip members, from the position of `file` to its end.
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

}  // namespace tagrid
