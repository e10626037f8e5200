// The strips and tiles of a page: whether compressed ones are whole, and in which order the bytes of floats
// are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "stages/sample/sample_type.h"

namespace tagrid {

/// libtiff stops when it has all samples, before the end of their stream and its checksum.
///
/// Why the stream of a strip or tile is damaged, of which from `least` to `most` bytes are expected: a sentence;
/// "" if nothing shows that. Streams of deflate and zstd end, with a right checksum if they have one; those of
/// LZW and PackBits have not more than is expected. Of other schemes, nothing is known. Bytes behind the end
/// are ignored.
std::string doubt_of_stream(std::uint16_t scheme, std::span<const std::byte> stream, std::uint64_t least,
                            std::uint64_t most);

/// Of floats whose bytes another program may have swapped.
enum class FloatOrder { usual, swapped, unclear };

/// The byte order of floats, judged by their magnitudes. `usual`: they have the byte order of
/// memory; `swapped`: they have the other one; `unclear`: in both orders, many are unusually large
/// or small. `type` is float32 or float64.
FloatOrder float_order_of(std::span<const std::byte> samples, SampleType type);

}  // namespace tagrid
