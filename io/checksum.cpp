#include "io/checksum.h"

#include <xxhash.h>

#include <new>

namespace tagrid {

struct RunningChecksum::State {
  std::unique_ptr<XXH3_state_t, XXH_errorcode (*)(XXH3_state_t*)> xxh3{XXH3_createState(), XXH3_freeState};
};

RunningChecksum::RunningChecksum(std::uint64_t bound_to) : state_(std::make_unique<State>()) {
  if (!state_->xxh3) throw std::bad_alloc();
  XXH3_64bits_reset_withSeed(state_->xxh3.get(), bound_to);
}

RunningChecksum::~RunningChecksum() = default;

void RunningChecksum::add(std::span<const std::byte> bytes) {
  XXH3_64bits_update(state_->xxh3.get(), bytes.data(), bytes.size());
}

std::uint64_t RunningChecksum::value() const { return XXH3_64bits_digest(state_->xxh3.get()); }

std::uint64_t checksum_of(std::initializer_list<std::span<const std::byte>> parts, std::uint64_t bound_to) {
  RunningChecksum checksum(bound_to);
  for (const auto& part : parts) checksum.add(part);
  return checksum.value();
}

bool checksums_agree([[maybe_unused]] std::uint64_t in_file, [[maybe_unused]] std::uint64_t computed) {
#ifdef TAGRID_NO_CHECKSUMS
  return true;
#else
  return in_file == computed;
#endif
}

}  // namespace tagrid
