// The probability of a binary event, learned while coding.
#pragma once

#include <algorithm>
#include <cstdint>

namespace tagrid {

/// Starts as a counter (the n-th event moves the probability by about 1/n) and becomes a moving average of
/// about 2^slowest events.
class AdaptiveBit {
 public:
  static constexpr int slowest = 6;

  /// Probability of a one, times 65536; far enough from 0 and 65536 for the range coder.
  std::uint32_t probability() const { return std::clamp<std::uint32_t>(p_, 48, 65536 - 48); }

  template <class Coder>
  bool code(Coder& coder, bool bit) {
    bit = coder.code(bit, probability());
    // Divisions by small counts, as multiplications: 65536 / (n + 1.5).
    static constexpr std::uint32_t rate[] = {
        43690, 26214, 18724, 14563, 11915, 10082, 8738, 7710, 6898, 6241, 5698, 5242, 4854, 4519, 4228, 3971,
        3744,  3542,  3360,  3196,  3048,  2912,  2788, 2674, 2570, 2473, 2383, 2299, 2221, 2148, 2080, 2016};
    const std::uint32_t step = n_ < 32 ? rate[n_] : 65536 >> slowest;
    if (bit)
      p_ += ((65535 - p_) * step) >> 16;
    else
      p_ -= (p_ * step) >> 16;
    if (n_ < 32) ++n_;
    return bit;
  }

 private:
  std::uint32_t p_ = 32768;
  std::uint32_t n_ = 0;
};

}  // namespace tagrid
