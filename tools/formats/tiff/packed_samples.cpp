#include "tools/formats/tiff/packed_samples.h"

#include <cassert>
#include <cstring>

namespace tagrid {

void unpack(const std::byte* packed, int bits, std::size_t count, std::byte* samples) {
  assert(1 <= bits && bits <= 15);
  std::uint32_t window = 0;  // bytes that were taken, of which the last `left` bits are still to come
  int left = 0;
  for (std::size_t i = 0; i < count; ++i) {
    for (; left < bits; left += 8) window = window << 8 | std::to_integer<std::uint32_t>(*packed++);
    left -= bits;
    const auto sample = static_cast<std::uint16_t>(window >> left & ((1U << bits) - 1));
    if (bits < 8)
      samples[i] = static_cast<std::byte>(sample);
    else
      std::memcpy(samples + 2 * i, &sample, sizeof sample);
  }
}

}  // namespace tagrid
