// A signed integer as adaptive binary events.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "stages/adaptive_bit.h"

namespace tagrid {

/// Zero or not, the sign, then the magnitude as Elias' gamma code: the number of its bits in unary, each an
/// event of its own, then the bits below the leading one; the first two of those are learned too, the rest
/// are taken as equally probable. Magnitudes up to 2^62.
class AdaptiveInteger {
 public:
  template <class Coder>
  std::int64_t code(Coder& coder, std::int64_t value) {
    if (!nonzero_.code(coder, value != 0)) return 0;
    const bool negative = negative_.code(coder, value < 0);
    const std::uint64_t known =
        value < 0 ? std::uint64_t{0} - static_cast<std::uint64_t>(value) : static_cast<std::uint64_t>(value);
    const auto magnitude = static_cast<std::int64_t>(code_magnitude(coder, known));
    return negative ? -magnitude : magnitude;
  }

 private:
  static constexpr std::size_t longest = 62;

  template <class Coder>
  std::uint64_t code_magnitude(Coder& coder, std::uint64_t known) {
    const std::size_t known_length = known == 0 ? 0 : static_cast<std::size_t>(std::bit_width(known)) - 1;
    std::size_t length = 0;
    while (length < longest && more_[length].code(coder, length < known_length)) ++length;
    std::uint64_t magnitude = 1;
    std::size_t left = length;
    for (std::size_t learned = 0; left > 0 && learned < 2; ++learned) {
      --left;
      AdaptiveBit& model = learned == 0 ? first_[length] : second_[length][magnitude & 1];
      magnitude = magnitude << 1 | std::uint64_t{model.code(coder, (known >> left) & 1)};
    }
    while (left > 0) {
      const auto step = static_cast<int>(std::min<std::size_t>(left, 16));
      left -= static_cast<std::size_t>(step);
      const auto bits = static_cast<std::uint32_t>(known >> left) & ((1U << step) - 1);
      magnitude = magnitude << step | coder.code_raw(bits, step);
    }
    return magnitude;
  }

  AdaptiveBit nonzero_, negative_;
  std::array<AdaptiveBit, longest> more_;
  std::array<AdaptiveBit, longest + 1> first_;
  std::array<std::array<AdaptiveBit, 2>, longest + 1> second_;
};

}  // namespace tagrid
