// The content of a bzip2 stream, decompressed as it is read. The format: https://sourceware.org/bzip2/
#pragma once

#include <memory>

#include "io/files/compressed_bytes.h"
#include "io/files/file_bytes.h"

namespace tagrid {

/// Reads one or more bzip2 streams from the position of `file` to its end.
class Bzip2Bytes final : public CompressedBytes {
 public:
  /// `file` must outlive this.
  explicit Bzip2Bytes(FileBytes& file);
  ~Bzip2Bytes() override;

  std::size_t read(std::byte* out, std::size_t size) override;
  void restart() override;
  /// A block of 900000 bytes is what is left of runs of up to 259 equal bytes, each of which takes 5. An empty block has
  /// more than 20 bytes.
  std::uint64_t max_ratio() const override { return 900'000 / 5 * 259 / 20; }
  const char* method() const override { return "bzip2"; }

  /// Bytes that a stream takes at most: 100k + 4 x 900k, and its input.
  static constexpr std::uint64_t memory = 3'800'000;

 private:
  struct Stream;
  bool next_stream();

  FileBytes& file_;
  std::unique_ptr<Stream> stream_;
};

/// True if the next bytes of a file begin a bzip2 stream, and no gzip or zlib stream. Does not move on.
bool begins_bzip2(FileBytes& file);

}  // namespace tagrid
