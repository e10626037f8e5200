// The probability of a binary event, learned while coding, and integers as such events. All arithmetic is in
// integers. Two predictions of one event are mixed in the logistic domain by weights that learn while coding
// (M. Mahoney, "Adaptive weighing of context models for lossless data compression", 2005).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

namespace tagrid {

/// ln(p / (1 - p)) in units of 1/256, within +-2047, for p = (index + 1/2) / 4096.
extern const std::array<std::int16_t, 4096> stretch_table;
/// The inverse: probability in units of 2^-16 for (index - 2048) / 256.
extern const std::array<std::uint16_t, 4096> squash_table;
/// 65536 / (n + 1.5): how far the n-th observation moves an adaptive bit.
extern const std::array<std::uint16_t, 1024> adaptation_table;

/// The probability of a one in 22 bits, and the number of observations in 10 bits.
struct AdaptiveBit {
  std::uint32_t state = std::uint32_t{1} << 31;

  AdaptiveBit() = default;
  /// As if `seen` events had been seen, with the probability of a one at `logit` / 256, within +-2047.
  explicit AdaptiveBit(int logit, std::uint32_t seen = 2)
      : state((std::uint32_t{squash_table[static_cast<std::size_t>(std::clamp(logit, -2047, 2047) + 2048)]}
               << 16) |
              seen) {}

  std::uint32_t probability() const { return std::clamp<std::uint32_t>(state >> 16, 1, 65535); }
  int stretched() const { return stretch_table[state >> 20]; }
  /// After `limit` observations, the bit forgets as fast as it learns.
  void learn(bool bit, std::uint32_t limit) {
    const std::uint32_t seen = state & 1023;
    const std::int64_t target = bit ? std::int64_t{0xfffffc00} : 0;
    const std::int64_t moved = ((target - (state - seen)) * adaptation_table[seen]) >> 16;
    state = ((state + static_cast<std::uint32_t>(moved)) & ~std::uint32_t{1023}) + seen + (seen < limit);
  }
};

template <class Coder>
bool code_adaptive(Coder& coder, bool bit, AdaptiveBit& model, std::uint32_t limit) {
  bit = coder.code(bit, model.probability());
  model.learn(bit, limit);
  return bit;
}

inline constexpr int contexts_mixed = 2;

/// Weights of the adaptive bits, in 2^-16. They are unsigned, so that a sum that wraps is defined. In
/// practice none does, as the error opposes what caused it.
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

/// Codes non-negative integers without a bound known to the model: Elias' gamma code with adaptive bits.
class IntegerModel {
 public:
  /// The most events of a value below 2^bits - 1; a sign of code_signed() is one bit more.
  static constexpr std::uint64_t most_events(int bits) { return 2 * static_cast<std::uint64_t>(bits) - 1; }

  /// Decoded values are below 2^41.
  template <class Coder>
  std::uint64_t code(Coder& coder, std::uint64_t value) {
    int length = 0;
    if constexpr (Coder::encoding)
      while ((value + 1) >> (length + 1)) ++length;
    int coded = 0;
    while (coded < 40 && code_adaptive(coder, coded < length, longer_[static_cast<std::size_t>(coded)], 60))
      ++coded;
    std::uint64_t result = 1;
    for (int left = coded; left-- > 0;) {
      const bool bit = ((value + 1) >> left) & 1;
      if (left + 1 == coded)
        result = result << 1 | code_adaptive(coder, bit, top_[static_cast<std::size_t>(coded - 1)], 60);
      else
        result = result << 1 | coder.code_raw(bit, 1);
    }
    return result - 1;
  }
  template <class Coder>
  std::int64_t code_signed(Coder& coder, std::int64_t value) {
    const std::uint64_t folded = code(coder, value < 0 ? static_cast<std::uint64_t>(-value) * 2 - 1
                                                       : static_cast<std::uint64_t>(value) * 2);
    return folded & 1 ? -static_cast<std::int64_t>((folded + 1) / 2) : static_cast<std::int64_t>(folded / 2);
  }

 private:
  std::array<AdaptiveBit, 40> longer_{}, top_{};
};

}  // namespace tagrid
