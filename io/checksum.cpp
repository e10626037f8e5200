#include "io/checksum.h"

#include <xxhash.h>

#include <array>
#include <memory>
#include <new>

#include "io/little_endian.h"

namespace tagrid {

std::uint64_t checksum_of(std::initializer_list<std::span<const std::byte>> parts) {
  const std::unique_ptr<XXH3_state_t, XXH_errorcode (*)(XXH3_state_t*)> state(XXH3_createState(),
                                                                              XXH3_freeState);
  if (!state) throw std::bad_alloc();
  XXH3_64bits_reset(state.get());
  for (const auto& part : parts) XXH3_64bits_update(state.get(), part.data(), part.size());
  return XXH3_64bits_digest(state.get());
}

std::uint64_t chained_checksum(std::uint64_t own, std::uint64_t before) {
  std::array<std::byte, 8> bytes;
  store_little_endian(bytes.data(), own);
  return XXH3_64bits_withSeed(bytes.data(), bytes.size(), before);
}

bool checksums_agree([[maybe_unused]] std::uint64_t in_file, [[maybe_unused]] std::uint64_t computed) {
#ifdef TAGRID_NO_CHECKSUMS
  return true;
#else
  return in_file == computed;
#endif
}

}  // namespace tagrid
