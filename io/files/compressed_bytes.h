// The content of a compressed stream, decompressed as it is read.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tagrid {

class CompressedBytes {
 public:
  virtual ~CompressedBytes() = default;

  /// Reads `size` bytes, or fewer at the end; returns their number. Throws BrokenInput if the stream is
  /// damaged, ends too soon, or is followed by something else.
  virtual std::size_t read(std::byte* out, std::size_t size) = 0;
  /// Starts again after the file has been moved back to the beginning of the stream.
  virtual void restart() = 0;

  /// At most so many bytes come from one compressed byte.
  virtual std::uint64_t max_ratio() const = 0;
  /// For messages: "gzip".
  virtual const char* method() const = 0;
};

}  // namespace tagrid
