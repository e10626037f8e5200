// Two predictions of one binary event, mixed in the logistic domain by weights that learn while coding
// (M. Mahoney, "Adaptive weighing of context models for lossless data compression", 2005).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "stages/entropy/adaptive_bit.h"

namespace tagrid {

inline constexpr int contexts_mixed = 2;

/// Weights of the adaptive bits, in 2^-16. They are unsigned, so that a sum that wraps is defined. In practice
/// none does, as the error opposes what caused it.
struct Mixer {
  std::array<std::uint32_t, contexts_mixed> weights;
  Mixer() { weights.fill(36 << 10); }
};

template <class Coder>
bool code_mixed(Coder& coder, bool bit, const std::array<AdaptiveBit*, contexts_mixed>& models, Mixer& mixer,
                std::uint32_t limit) {
  std::array<std::int32_t, contexts_mixed> inputs;
  std::int64_t sum = 0;
  for (std::size_t i = 0; i < contexts_mixed; ++i) {
    inputs[i] = models[i]->stretched();
    sum += static_cast<std::int64_t>(inputs[i]) * static_cast<std::int32_t>(mixer.weights[i]);
  }
  const auto mixed = std::clamp<std::int64_t>(sum >> 16, -2047, 2047);
  const std::uint32_t p = squash_table[static_cast<std::size_t>(mixed + 2048)];
  bit = coder.code(bit, p);
  const std::int32_t error = (bit ? 65535 : 0) - static_cast<std::int32_t>(p);
  for (std::size_t i = 0; i < contexts_mixed; ++i) {
    mixer.weights[i] += static_cast<std::uint32_t>((inputs[i] * error + (1 << 15)) >> 16);
    models[i]->learn(bit, limit);
  }
  return bit;
}

}  // namespace tagrid
