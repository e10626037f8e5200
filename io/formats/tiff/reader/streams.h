// Whether compressed strips and tiles are whole. libtiff stops when it has all samples, before the end of their
// stream and its checksum.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace tagrid {

/// Why the stream of a strip or tile is damaged, of which from `least` to `most` bytes are expected: a sentence;
/// "" if nothing shows that. Streams of deflate and zstd end, with a right checksum if they have one; those of
/// LZW and PackBits have not more than is expected. Of other schemes, nothing is known. Bytes behind the end
/// are ignored.
std::string doubt_of_stream(std::uint16_t scheme, std::span<const std::byte> stream, std::uint64_t least,
                            std::uint64_t most);

}  // namespace tagrid
