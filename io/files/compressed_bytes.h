// The content of a compressed stream, decompressed as it is read.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "io/files/file_bytes.h"

namespace tagrid {

enum class Compression {
  gzip,    ///< one or more gzip members (RFC 1952), or a zlib stream (RFC 1950)
  bzip2,   ///< one or more bzip2 streams (https://sourceware.org/bzip2/)
  zlib,    ///< a zlib stream (RFC 1950); what follows it does not count
  deflate  ///< the same without its head and its checksum (RFC 1951)
};

/// Reads a stream from the position of a file, or of other bytes, to its end.
class CompressedBytes {
 public:
  /// `file` must outlive this.
  CompressedBytes(ByteStream& file, Compression compression);
  ~CompressedBytes();

  /// Reads `size` bytes, or fewer at the end; returns their number. Throws BrokenInput if the stream is
  /// damaged, ends too soon, or is followed by something that counts.
  std::size_t read(std::byte* out, std::size_t size);
  /// Starts again after the file has been moved back to the beginning of the stream.
  void restart();

  /// The most bytes that come from one compressed byte.
  std::uint64_t max_ratio() const;
  /// For messages: "gzip".
  const char* method() const;

  /// Bytes that a bzip2 stream takes at most: 100k + 4 x 900k, and its input.
  static constexpr std::uint64_t memory_of_bzip2 = 3'800'000;

  class Decoder;

 private:
  bool has_waiting();
  bool next_stream();

  ByteStream& file_;
  Compression compression_;
  std::unique_ptr<Decoder> decoder_;
  std::vector<std::byte> input_;
  std::span<const std::byte> waiting_;  ///< bytes of input_ that are not yet decompressed
  bool at_end_ = false;
};

/// True if the next bytes of a file begin a gzip stream. Does not move on.
bool begins_gzip(FileBytes& file);
/// The same for a bzip2 stream.
bool begins_bzip2(FileBytes& file);

/// The first `size` bytes, or fewer, of the content of the gzip stream that follows in the file, up to any
/// damage. Does not move on. REQUIRES: size <= 4096.
std::string beginning_of_gzip(FileBytes& file, std::size_t size);

}  // namespace tagrid
