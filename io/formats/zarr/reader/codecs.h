// How the bytes of chunks are compressed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace tagrid {

enum class ZarrCodec : std::uint8_t {
  blosc,  ///< https://www.blosc.org: any of its compressors that the library has
  zstd,
  zlib,  ///< with the header of zlib or of gzip
  crc32c,
};

/// Undoes `codecs`, given in the order of compression, of which at most one compresses. Returns exactly
/// `size` bytes. `name` is that of the file, for messages. Safe for any bytes; takes `size` bytes of memory,
/// and as many as `stored` has. Throws BrokenInput.
std::vector<std::byte> decompressed(std::vector<std::byte> stored, std::span<const ZarrCodec> codecs,
                                    std::uint64_t size, const std::string& name);

}  // namespace tagrid
