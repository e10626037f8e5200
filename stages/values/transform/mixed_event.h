// A binary event of a coefficient, predicted in two contexts. Weights that learn mix the two predictions; the mean of
// the mixed one and of the observed frequency of such mixtures is used, as in stages/values/best.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "stages/entropy/adaptive_bit.h"

namespace tagrid {

using MixerWeights = std::array<std::int32_t, 2>;  ///< of both contexts, in 2^-16
inline constexpr MixerWeights first_mixer_weights = {1 << 15, 1 << 15};

/// Observed frequencies of what was mixed, at equal steps of its logit.
using Refinement = std::array<std::uint16_t, 33>;
/// That of a mixture which has been right so far.
inline Refinement first_refinement() {
  Refinement identity;
  for (std::size_t i = 0; i < identity.size(); ++i)
    identity[i] = squash_table[std::min<std::size_t>(i * 128, 4095)];
  return identity;
}

/// -log2 of a probability in 2^-8, by its upper 12 bits.
inline constexpr std::array<std::uint16_t, 4096> cost_table = [] {
  std::array<std::uint16_t, 4096> costs{};
  for (std::uint32_t i = 0; i < 4096; ++i) {
    // The logarithm of (2i + 1) / 8192, bit by bit: squaring doubles it.
    std::uint64_t v = 2 * i + 1;
    const int whole = static_cast<int>(std::bit_width(v)) - 1;
    v <<= 31 - whole;
    std::uint32_t fraction = 0;
    for (int bit = 0; bit < 8; ++bit) {
      v = v * v >> 31;
      const bool two = v >> 32 != 0;
      fraction = 2 * fraction + two;
      if (two) v >>= 1;
    }
    costs[i] = static_cast<std::uint16_t>(13 * 256 - (static_cast<std::uint32_t>(whole) * 256 + fraction));
  }
  return costs;
}();

/// One event, before it is known. It refers to what it was predicted from.
class MixedEvent {
 public:
  MixedEvent() = default;
  /// Not refined if `refinement` is null.
  MixedEvent(AdaptiveBit& first, AdaptiveBit& second, MixerWeights& weights, Refinement* refinement)
      : bits_{&first, &second}, weights_(&weights), inputs_{first.stretched(), second.stretched()} {
    const std::int32_t sum = inputs_[0] * (weights[0] >> 4) + inputs_[1] * (weights[1] >> 4);
    const auto mixed = static_cast<std::uint32_t>(std::clamp(sum >> 12, -2047, 2047) + 2048);
    mixed_ = squash_table[mixed];
    between_ = nullptr;
    std::uint32_t refined = mixed_;
    if (refinement != nullptr) {
      between_ = refinement->data() + (mixed >> 7);
      part_ = mixed & 127;
      refined = (between_[0] * (128 - part_) + between_[1] * part_) >> 7;
    }
    probability_ =
        std::clamp<std::uint32_t>((mixed_ + refined) >> 1, least_probability, 65536 - least_probability);
  }

  /// That it happens, in 2^-16.
  std::uint32_t probability() const { return probability_; }

  /// The bits that the outcome takes, in 2^-8.
  std::uint16_t cost(bool bit) const { return cost_table[(bit ? probability_ : 65536 - probability_) >> 4]; }

  void learn(bool bit) const {
    const std::int32_t target = bit ? 65535 : 0, error = target - static_cast<std::int32_t>(mixed_);
    if (between_ != nullptr) {
      std::uint16_t& nearer = between_[part_ > 64];
      nearer = static_cast<std::uint16_t>(nearer + ((target - nearer) >> 6));
    }
    for (std::size_t i = 0; i < 2; ++i) {
      std::int32_t& weight = (*weights_)[i];
      weight = std::clamp(weight + ((inputs_[i] * error + (1 << (mix_shift - 1))) >> mix_shift),
                          -weight_limit, weight_limit);
      bits_[i]->learn(bit, forget_after);
    }
  }

 private:
  static constexpr std::uint32_t forget_after = 255, least_probability = 32;
  static constexpr std::int32_t weight_limit = 1 << 18;
  static constexpr int mix_shift = 14;  ///< how fast weights learn

  std::array<AdaptiveBit*, 2> bits_;
  MixerWeights* weights_;
  std::uint16_t* between_;  ///< null: not refined
  std::uint32_t part_;
  std::array<std::int32_t, 2> inputs_;
  std::uint32_t mixed_, probability_;
};

}  // namespace tagrid
