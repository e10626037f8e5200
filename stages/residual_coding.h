// Coding of one quantized residual in the context of what is known around it.
//
// Every binary decision is predicted by four adaptive bits, each selected by another context, and the four
// are mixed.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>

#include "stages/integer_model.h"
#include "stages/mixer.h"

namespace tagrid {

inline constexpr std::array<int, contexts_mixed> magnitude_contexts = {64, 512, 512, 512};
inline constexpr std::array<int, contexts_mixed> sign_contexts = {32, 32, 128, 32};
inline constexpr int mixer_contexts = 8;

/// What is known of a residual before it is coded. Numbers of contexts are limited by the tables above.
struct ResidualContext {
  std::array<std::uint16_t, contexts_mixed> magnitude{}, sign{};
  std::uint8_t mixer = 0;
  std::uint8_t low_bits = 0;  ///< bits of the magnitude that are nearly uniform
  bool flat = false;          ///< all neighbours are equal
};

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
  std::array<Mixer, mixer_contexts * mixed_depths> magnitude_mixers_{};
  std::array<std::array<AdaptiveBit, 128>, contexts_mixed> sign_{};
  Mixer sign_mixer_{};
  std::array<std::array<std::array<AdaptiveBit, 4>, 4>, 16> low_{};
  AdaptiveBit flat_zero_, flat_sign_;
  IntegerModel flat_magnitude_, beyond_;
};

}  // namespace tagrid
