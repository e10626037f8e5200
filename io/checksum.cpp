#include "io/checksum.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace tagrid {

std::uint64_t checksum_of(std::initializer_list<std::span<const std::byte>> parts, std::uint64_t bound_to) {
  XXH3_state_t state;
  XXH3_64bits_reset_withSeed(&state, bound_to);
  for (const auto& part : parts) XXH3_64bits_update(&state, part.data(), part.size());
  return XXH3_64bits_digest(&state);
}

}  // namespace tagrid
