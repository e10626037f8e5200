#include "io/temporaries.h"

#include <sys/random.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <climits>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string_view>

namespace tagrid {
namespace {

constexpr int slot_count = 64;
enum SlotState : int { slot_free, slot_filling, slot_used };
std::array<std::atomic<int>, slot_count> slot_states = {};
char slot_paths[slot_count][PATH_MAX], slot_originals[slot_count][PATH_MAX];

}  // namespace

int register_temporary(const std::string& path, const std::string& original) {
  if (path.size() >= PATH_MAX || original.size() >= PATH_MAX) return -1;
  for (int slot = 0; slot < slot_count; ++slot) {
    int expected = slot_free;
    auto& state = slot_states[static_cast<std::size_t>(slot)];
    if (!state.compare_exchange_strong(expected, slot_filling)) continue;
    std::memcpy(slot_paths[slot], path.c_str(), path.size() + 1);
    std::memcpy(slot_originals[slot], original.c_str(), original.size() + 1);
    state.store(slot_used);
    return slot;
  }
  return -1;
}

void forget_temporary(int slot) {
  if (slot >= 0) slot_states[static_cast<std::size_t>(slot)].store(slot_free);
}

std::string random_suffix() {
  constexpr std::string_view letters = "abcdefghijklmnopqrstuvwxyz012345";
  std::array<unsigned char, 6> random = {};
  if (getrandom(random.data(), random.size(), 0) != static_cast<ssize_t>(random.size()))
    for (auto& byte : random) byte = static_cast<unsigned char>(std::rand());
  std::string suffix;
  for (unsigned char byte : random) suffix += letters[byte % letters.size()];
  return suffix;
}

void unlink_temporaries() noexcept {
  for (int slot = 0; slot < slot_count; ++slot) {
    if (slot_states[static_cast<std::size_t>(slot)].load() != slot_used) continue;
    if (slot_originals[slot][0] != '\0') std::rename(slot_paths[slot], slot_originals[slot]);
    // Also after that: a name is not taken away where both are of one file.
    unlink(slot_paths[slot]);
  }
}

}  // namespace tagrid
