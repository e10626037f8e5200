// The bytes inside of a gzip stream (RFC 1952), decompressed as they are read.
#pragma once

#include <cstddef>
#include <memory>

#include "io/files/file_bytes.h"

namespace tagrid {

/// Reads one or more gzip members that begin where `file` stands and end where the file ends.
class GzipBytes {
 public:
  /// `file` must outlive this.
  explicit GzipBytes(FileBytes& file);
  ~GzipBytes();

  /// Reads `size` bytes, less only at the end; returns how many. Throws BrokenInput if the stream is damaged,
  /// ends too soon, or is followed by something else.
  std::size_t read(std::byte* out, std::size_t size);
  /// Begins again, once the file was moved back to the first member.
  void restart();

 private:
  struct Stream;
  bool next_member();

  FileBytes& file_;
  std::unique_ptr<Stream> stream_;
};

}  // namespace tagrid
