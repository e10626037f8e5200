#include "io/bytes/checksum.h"

#include <xxhash.h>

#include <array>
#include <new>

#include "io/bytes/little_endian.h"

namespace tagrid {

RunningChecksum::RunningChecksum()
    : state_(XXH3_createState(), [](XXH3_state_s* state) { XXH3_freeState(state); }) {
  if (!state_) throw std::bad_alloc();
  XXH3_64bits_reset(state_.get());
}

void RunningChecksum::add(std::span<const std::byte> bytes) {
  XXH3_64bits_update(state_.get(), bytes.data(), bytes.size());
}

std::uint64_t RunningChecksum::value() const { return XXH3_64bits_digest(state_.get()); }

std::uint64_t checksum_of(std::initializer_list<std::span<const std::byte>> parts) {
  RunningChecksum checksum;
  for (const auto& part : parts) checksum.add(part);
  return checksum.value();
}

std::pair<std::uint64_t, std::uint64_t> wide_checksum_of(std::string_view text) {
  const XXH128_hash_t checksum = XXH3_128bits(text.data(), text.size());
  return {checksum.high64, checksum.low64};
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
