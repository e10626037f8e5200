// Coding of one quantized residual in the context of what is known around it.
//
// Every binary decision is predicted by four adaptive bits, each selected by another context, and the four
// are mixed in the logistic domain by weights that learn while coding (M. Mahoney, "Adaptive weighing of
// context models for lossless data compression", 2005). All arithmetic is in integers.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>

#include "stages/range_coder.h"

namespace tagrid {

/// ln(p / (1 - p)) in units of 1/256, within +-2047, for p = (index + 1/2) / 4096.
extern const std::array<std::int16_t, 4096> stretch_table;
/// The inverse: probability in units of 2^-16 for (index - 2048) / 256.
extern const std::array<std::uint16_t, 4096> squash_table;
/// 65536 / (n + 1.5): how far the n-th observation moves an adaptive bit.
extern const std::array<std::uint16_t, 1024> adaptation_table;

/// Probability of a one in 22 bits, and how often it was observed in 10 bits.
struct AdaptiveBit {
  std::uint32_t state = std::uint32_t{1} << 31;

  std::uint32_t probability() const { return std::clamp<std::uint32_t>(state >> 16, 1, 65535); }
  int stretched() const { return stretch_table[state >> 20]; }
  /// `limit` is the number of observations after which the bit forgets as fast as it learns.
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

/// Non-negative integers without a bound known to the model: Elias' gamma code with adaptive bits.
class IntegerModel {
 public:
  /// Decoded values never exceed 2^40.
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

inline constexpr int contexts_mixed = 4;
inline constexpr std::array<int, contexts_mixed> magnitude_contexts = {64, 512, 512, 512};
inline constexpr std::array<int, contexts_mixed> sign_contexts = {32, 32, 128, 32};
inline constexpr int mixer_contexts = 16;

/// What is known of a residual before it is coded. Numbers of contexts are limited by the tables above.
struct ResidualContext {
  std::array<std::uint16_t, contexts_mixed> magnitude{}, sign{};
  std::uint8_t mixer = 0;
  std::uint8_t low_bits = 0;  ///< bits of the magnitude that are nearly uniform
  bool flat = false;          ///< all neighbours are equal
};

/// Weights of the four adaptive bits, in 2^-16. Unsigned, so that a sum that wraps is defined; the error
/// opposes what made it, so none does.
struct Mixer {
  std::array<std::uint32_t, contexts_mixed> weights;
  Mixer() { weights.fill(24 << 10); }
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

/// All adaptive state of one brick. About 40 KB.
class ResidualModel {
 public:
  /// Codes a residual of magnitude at most `largest`; decoded values keep to it as well.
  template <class Coder>
  std::int64_t code(Coder& coder, std::int64_t residual, std::int64_t largest,
                    const ResidualContext& context) {
    const auto given = static_cast<std::uint64_t>(std::abs(residual));
    std::uint64_t magnitude = 0;
    if (context.flat) {
      if (code_adaptive(coder, given != 0, flat_zero_, 1000))
        magnitude = 1 + flat_magnitude_.code(coder, given - 1);
      if (magnitude == 0) return 0;
      magnitude = std::min(magnitude, static_cast<std::uint64_t>(largest));
      const bool negative = code_adaptive(coder, residual < 0, flat_sign_, 250);
      return negative ? -static_cast<std::int64_t>(magnitude) : static_cast<std::int64_t>(magnitude);
    }
    const int low_bits = context.low_bits;
    const std::uint64_t high = code_high(coder, given >> low_bits, context);
    magnitude = high << low_bits | code_low(coder, given, high, low_bits);
    if (magnitude == 0) return 0;
    magnitude = std::min(magnitude, static_cast<std::uint64_t>(largest));
    return code_sign(coder, residual < 0, context) ? -static_cast<std::int64_t>(magnitude)
                                                   : static_cast<std::int64_t>(magnitude);
  }

 private:
  static constexpr std::uint64_t unary_limit = 24;
  static constexpr std::size_t depths = 4, mixed_depths = 2;
  static constexpr std::uint32_t limit = 255;

  template <class Coder>
  std::uint64_t code_high(Coder& coder, std::uint64_t given, const ResidualContext& context) {
    std::uint64_t high = 0;
    while (high < unary_limit) {
      const std::size_t depth = std::min<std::uint64_t>(high, depths - 1);
      std::array<AdaptiveBit*, contexts_mixed> models;
      for (std::size_t i = 0; i < contexts_mixed; ++i)
        models[i] = &magnitude_[i][context.magnitude[i] * depths + depth];
      // Further decisions are rare, or nearly the same in every context.
      if (depth >= mixed_depths) {
        if (!code_adaptive(coder, given > high, *models[0], limit)) return high;
        ++high;
        continue;
      }
      if (!code_mixed(coder, given > high, models, magnitude_mixers_[depth * mixer_contexts + context.mixer],
                      limit))
        return high;
      ++high;
    }
    return high + beyond_.code(coder, given - high);
  }

  template <class Coder>
  std::uint64_t code_low(Coder& coder, std::uint64_t given, std::uint64_t high, int low_bits) {
    std::uint64_t low = 0;
    int left = low_bits;
    // The density falls within a step of the high part: visibly in the first two bits, not in the others.
    auto& models = low_[static_cast<std::size_t>(std::min(low_bits, 15))][std::min<std::size_t>(high, 3)];
    for (std::size_t path = 1; left > 0 && path < 4;) {
      --left;
      const bool bit = code_adaptive(coder, (given >> left) & 1, models[path], 500);
      path = path << 1 | bit;
      low = low << 1 | bit;
    }
    while (left > 0) {
      const int count = std::min(left, 16);
      left -= count;
      low = low << count |
            coder.code_raw(static_cast<std::uint32_t>((given >> left) & ((std::uint64_t{1} << count) - 1)),
                           count);
    }
    return low;
  }

  template <class Coder>
  bool code_sign(Coder& coder, bool negative, const ResidualContext& context) {
    if (context.low_bits >= 3) return coder.code_raw(negative, 1) != 0;
    std::array<AdaptiveBit*, contexts_mixed> models;
    for (std::size_t i = 0; i < contexts_mixed; ++i) models[i] = &sign_[i][context.sign[i]];
    return code_mixed(coder, negative, models, sign_mixer_, limit);
  }

  std::array<std::array<AdaptiveBit, 512 * depths>, contexts_mixed> magnitude_{};
  std::array<Mixer, mixer_contexts * depths> magnitude_mixers_{};
  std::array<std::array<AdaptiveBit, 128>, contexts_mixed> sign_{};
  Mixer sign_mixer_{};
  std::array<std::array<std::array<AdaptiveBit, 4>, 4>, 16> low_{};
  AdaptiveBit flat_zero_, flat_sign_;
  IntegerModel flat_magnitude_, beyond_;
};

}  // namespace tagrid
