// The content of a gzip stream (RFC 1952), decompressed as it is read.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "io/files/compressed_bytes.h"
#include "io/files/file_bytes.h"

namespace tagrid {

/// Reads one or more gzip members, or a zlib stream (RFC 1950), from the position of `file` to its end.
class GzipBytes final : public CompressedBytes {
 public:
  /// `file` must outlive this.
  explicit GzipBytes(FileBytes& file);
  ~GzipBytes() override;

  std::size_t read(std::byte* out, std::size_t size) override;
  void restart() override;
  /// Deflate expands one byte to at most 1032.
  std::uint64_t max_ratio() const override { return 1040; }
  const char* method() const override { return "gzip"; }

 private:
  struct Stream;
  bool next_member();

  FileBytes& file_;
  std::unique_ptr<Stream> stream_;
};

/// True if the next bytes of a file begin a gzip stream. Does not move on.
bool begins_gzip(FileBytes& file);

/// The first `size` bytes, or fewer, of the content of the gzip stream that follows in the file, up to any
/// damage. Does not move on. REQUIRES: size <= 4096.
std::string beginning_of_gzip(FileBytes& file, std::size_t size);

}  // namespace tagrid
