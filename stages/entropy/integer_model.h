// Integers as adaptive binary events.
#pragma once

#include <array>
#include <cstdint>

#include "stages/entropy/adaptive_bit.h"

namespace tagrid {

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
