// Samples of other than 8, 16, 32 and 64 bits, as TIFF packs them.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tagrid {

/// Unpacks unsigned integers of `bits` bits, which follow each other with the highest bit first: to bytes if bits < 8,
/// otherwise to 16-bit integers in the byte order of memory. REQUIRES: 1 <= bits <= 15; `packed` has
/// (count * bits + 7) / 8 bytes, `samples` has room for `count`.
void unpack(const std::byte* packed, int bits, std::size_t count, std::byte* samples);

}  // namespace tagrid
