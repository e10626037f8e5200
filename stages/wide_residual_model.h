// Residuals of up to 64 bits and a sign, as adaptive binary events: zero or not, the number of binary digits,
// the two digits after the first, and the rest as it is.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <memory>

#include "stages/adaptive_bit.h"

namespace tagrid {

/// A residual: `magnitude` steps, up or down.
struct WideResidual {
  std::uint64_t magnitude = 0;
  bool negative = false;
};

/// v up to 2^(m+1), then 2^m values for each power of two. Below (65 - m) * 2^m.
template <int m>
constexpr std::uint32_t log_steps(std::uint64_t v) {
  const int over = std::bit_width(v) - (m + 1);
  return over <= 0 ? static_cast<std::uint32_t>(v)
                   : (static_cast<std::uint32_t>(over) << m) + static_cast<std::uint32_t>(v >> over);
}

/// What is known of a residual before it is coded.
struct WideContext {
  std::uint32_t energy = 0;  ///< log_steps<2> of the residuals around; below 256
  std::uint32_t second = 0;  ///< below 512
  std::uint32_t sign = 0;    ///< below 256
};

class WideResidualModel {
 public:
  /// Encoding, returns `residual`; decoding, ignores it and returns what was coded.
  template <class Coder>
  WideResidual code(Coder& coder, WideResidual residual, const WideContext& context) {
    if (!code_twin(coder, residual.magnitude != 0, zero_by_energy_[context.energy],
                   zero_by_second_[context.second]))
      return {};
    const std::uint32_t octave = context.energy / 2;
    auto& length_bits = length_[octave];
    const std::uint32_t length = static_cast<std::uint32_t>(std::bit_width(residual.magnitude)) - 1;
    std::uint32_t path = 1;
    for (int bit = 5; bit >= 0; --bit)
      path = 2 * path + code_adaptive(coder, (length >> bit) & 1, length_bits[path], 255);
    const std::uint32_t digits = path - 64;  // after the first
    // Where the number lies among those that were usual here.
    const std::uint32_t usual = octave / 2;
    const std::size_t place = digits + 4 < usual ? 0 : digits + 3 > usual ? 2 : 1;
    std::uint64_t magnitude = 1;
    std::uint32_t left = digits;
    for (std::uint32_t node = 1; left > 0 && node < 4; --left) {
      const bool bit =
          code_adaptive(coder, (residual.magnitude >> (left - 1)) & 1, digit_[digits][place][node], 255);
      node = 2 * node + bit;
      magnitude = 2 * magnitude + bit;
    }
    while (left > 0) {
      const int bits = static_cast<int>(std::min<std::uint32_t>(left, 16));
      left -= static_cast<std::uint32_t>(bits);
      const std::uint32_t low = coder.code_raw(
          static_cast<std::uint32_t>(residual.magnitude >> left) & ((std::uint32_t{1} << bits) - 1), bits);
      magnitude = magnitude << bits | low;
    }
    const bool negative = code_adaptive(coder, residual.negative, sign_[context.sign], 255);
    return {magnitude, negative};
  }

 private:
  // Two opinions on one event, their mean.
  template <class Coder>
  static bool code_twin(Coder& coder, bool bit, AdaptiveBit& a, AdaptiveBit& b) {
    bit = coder.code(bit, (a.probability() + b.probability()) / 2);
    a.learn(bit, 400);
    b.learn(bit, 400);
    return bit;
  }

  std::array<AdaptiveBit, 256> zero_by_energy_{};
  std::array<AdaptiveBit, 512> zero_by_second_{};
  std::array<std::array<AdaptiveBit, 64>, 128> length_{};
  std::array<std::array<std::array<AdaptiveBit, 4>, 3>, 64> digit_{};
  std::array<AdaptiveBit, 256> sign_{};
};

/// `bits` bits, all equally probable, the upper ones first.
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

}  // namespace tagrid
