// Codes residuals of up to 64 bits and a sign as adaptive binary events: zero or not, the number of binary
// digits, and the two digits after the first. Further digits are stored as they are.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

#include "stages/entropy/adaptive_bit.h"

namespace tagrid {

/// A residual: `magnitude` steps, up or down.
struct WideResidual {
  std::uint64_t magnitude = 0;
  bool negative = false;
};

/// v itself up to 2^(m+1), then 2^m values for each power of two. Below (65 - m) * 2^m.
template <int m>
constexpr std::uint32_t log_steps(std::uint64_t v) {
  const int over = std::bit_width(v) - (m + 1);
  return over <= 0 ? static_cast<std::uint32_t>(v)
                   : (static_cast<std::uint32_t>(over) << m) + static_cast<std::uint32_t>(v >> over);
}

/// The context of a residual.
struct WideContext {
  std::uint32_t energy = 0;              ///< log_steps<2> of the residuals around; below 256
  std::array<std::uint32_t, 3> views{};  ///< three descriptions of the surroundings; below 512
  std::array<std::uint32_t, 2> sign{};   ///< below 256
};

/// Several predictions of one event, mixed in the logistic domain by weights that learn (M. Mahoney,
/// "Adaptive weighing of context models for lossless data compression", 2005).
template <std::size_t n>
class OpinionMixer {
 public:
  template <class Coder>
  bool code(Coder& coder, bool bit, const std::array<AdaptiveBit*, n>& models) {
    std::array<std::int64_t, n> inputs;
    std::int64_t sum = 0;
    for (std::size_t i = 0; i < n; ++i) {
      inputs[i] = models[i]->stretched();
      sum += inputs[i] * weights_[i];
    }
    const auto mixed = std::clamp<std::int64_t>(sum >> 16, -2047, 2047);
    const std::uint32_t p = squash_table[static_cast<std::size_t>(mixed + 2048)];
    bit = coder.code(bit, p);
    const std::int64_t error = (bit ? 65535 : 0) - static_cast<std::int64_t>(p);
    for (std::size_t i = 0; i < n; ++i) {
      // The error opposes what caused it, so weights stay far below this limit.
      weights_[i] = std::clamp<std::int64_t>(weights_[i] + ((inputs[i] * error + (1 << 15)) >> 16),
                                             -(1 << 30), 1 << 30);
      models[i]->learn(bit, 255);
    }
    return bit;
  }

 private:
  std::array<std::int64_t, n> weights_ = make_weights();
  static std::array<std::int64_t, n> make_weights() {
    std::array<std::int64_t, n> weights;
    weights.fill(98304 / static_cast<std::int64_t>(n));
    return weights;
  }
};

/// Codes `bits` bits, all equally probable, the upper ones first.
template <class Coder>
std::uint64_t code_raw_bits(Coder& coder, std::uint64_t value, int bits) {
  std::uint64_t result = 0;
  while (bits > 0) {
    const int now = std::min(bits, 16);
    bits -= now;
    const auto part = static_cast<std::uint32_t>(value >> bits) & ((std::uint32_t{1} << now) - 1);
    result = result << now | coder.code_raw(part, now);
  }
  return result;
}

class WideResidualModel {
 public:
  /// The most events of a residual of `bits` bits: two and a sign, the number of its digits, the
  /// three after the first, and the others, sixteen at a time.
  static constexpr std::uint64_t most_events(int bits) {
    return 2 + 1 + 6 + 3 + (static_cast<std::uint64_t>(bits) + 11) / 16;
  }

  /// Encoding, returns `residual`; decoding, ignores it and returns what was coded.
  template <class Coder>
  WideResidual code(Coder& coder, WideResidual residual, const WideContext& context) {
    if (!code_step(coder, residual.magnitude > 0, 0, context)) return {};
    std::uint64_t magnitude = 1;
    if (code_step(coder, residual.magnitude > 1, 1, context))
      magnitude = code_large(coder, residual.magnitude, context);
    const bool negative =
        sign_mixer_.code(coder, residual.negative, {&sign_[0][context.sign[0]], &sign_[1][context.sign[1]]});
    return {magnitude, negative};
  }

 private:
  template <class Coder>
  bool code_step(Coder& coder, bool bit, std::size_t step, const WideContext& context) {
    return mixers_[step][context.energy / 8].code(
        coder, bit,
        {&by_energy_[step][context.energy], &by_view_[0][step][context.views[0]],
         &by_view_[1][step][context.views[1]], &by_view_[2][step][context.views[2]]});
  }

  // Codes a magnitude from 2 on: the number of its digits, then the digits.
  template <class Coder>
  std::uint64_t code_large(Coder& coder, std::uint64_t value, const WideContext& context) {
    const std::uint32_t octave = context.energy / 2;
    auto& length_bits = length_[octave];
    const std::uint32_t length = static_cast<std::uint32_t>(std::bit_width(value)) - 1;
    std::uint32_t path = 1;
    for (int bit = 5; bit >= 0; --bit)
      path = 2 * path + code_adaptive(coder, (length >> bit) & 1, length_bits[path], 255);
    const std::uint32_t digits = path - 64;  // after the first
    // How the number of digits compares with the usual one here.
    const std::uint32_t usual = octave / 2;
    const std::size_t place = digits + 4 < usual ? 0 : digits + 3 > usual ? 2 : 1;
    std::uint64_t magnitude = 1;
    std::uint32_t left = digits;
    for (std::uint32_t node = 1; left > 0 && node < 8; --left) {
      const bool bit = code_adaptive(coder, (value >> (left - 1)) & 1, digit_[digits][place][node], 255);
      node = 2 * node + bit;
      magnitude = 2 * magnitude + bit;
    }
    return magnitude << left | code_raw_bits(coder, value, static_cast<int>(left));
  }

  std::array<std::array<AdaptiveBit, 256>, 2> by_energy_{};
  std::array<std::array<std::array<AdaptiveBit, 512>, 2>, 3> by_view_{};
  std::array<std::array<OpinionMixer<4>, 32>, 2> mixers_{};
  std::array<std::array<AdaptiveBit, 64>, 128> length_{};
  std::array<std::array<std::array<AdaptiveBit, 8>, 3>, 64> digit_{};
  std::array<std::array<AdaptiveBit, 256>, 2> sign_{};
  OpinionMixer<2> sign_mixer_;
};

}  // namespace tagrid
