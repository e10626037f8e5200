// By how much predictions are off on average, in contexts. What is learned in a few steps corrects the next
// ones.
#pragma once

#include <cstdint>
#include <cstring>

#include "stages/values/wavefront/schedule.h"
#include "stages/values/wavefront/vectors.h"

HWY_BEFORE_NAMESPACE();
namespace tagrid::HWY_NAMESPACE {

inline constexpr int bias_count = 192;
inline constexpr int bias_window = 64;  ///< voxels after which a bias forgets

/// Biases and errors are in 2^-11.
class Biases {
 public:
  Biases() {
    std::int32_t of_lane[wave_lanes];
    for (int i = 0; i < wave_lanes; ++i) of_lane[i] = bias_count + i;
    none_ = load32(of_lane);
    std::memset(value_, 0, sizeof value_);
    std::memset(seen_, 0, sizeof seen_);
    std::memset(sum_, 0, sizeof sum_);
  }

  TAGRID_LANE I32 of(I32 context) const { return gather(value_, context); }
  /// For lanes that learn nothing. They add to entries of their own, so that they do not wait for each other.
  TAGRID_LANE I32 none() const { return none_; }

  TAGRID_STEP void add(I32 context, I32 errors) {
    alignas(64) std::int32_t index[wave_lanes], error[wave_lanes];
    store(context, index);
    store(errors, error);
    TAGRID_UNROLL
    for (int i = 0; i < wave_lanes; ++i) {
      std::uint64_t sum;
      std::memcpy(&sum, sum_[index[i]], 8);
      sum += (static_cast<std::uint64_t>(static_cast<std::int64_t>(error[i])) << 32) + 1;
      std::memcpy(sum_[index[i]], &sum, 8);
    }
  }

  /// Moves the biases by what was added.
  HWY_NOINLINE void learn() {
    for (int c = 0; c < bias_count; c += wave_lanes) {
      std::uint64_t sums[wave_lanes], any = 0;
      std::memcpy(sums, sum_[c], sizeof sums);
      for (const std::uint64_t s : sums) any |= s;
      if (any == 0) continue;
      alignas(64) std::int32_t count[wave_lanes], sum[wave_lanes];
      for (int i = 0; i < wave_lanes; ++i) {
        count[i] = sum_[c + i][0];
        sum[i] = sum_[c + i][1];
      }
      const I32 n = load32(count) + load32(seen_ + c);
      const I32 step = truncated(to_float(load32(sum)) / (to_float(n) + set_float(0.5f)));
      store(max(min(load32(value_ + c) + step, set32(1 << 27)), set32(-(1 << 27))), value_ + c);
      store(min(n, set32(bias_window)), seen_ + c);
      std::memset(sum_[c], 0, sizeof sum_[c] * wave_lanes);
    }
  }

 private:
  I32 none_;
  alignas(64) std::int32_t value_[bias_count], seen_[bias_count];
  /// How many errors, and their sum.
  alignas(64) std::int32_t sum_[bias_count + wave_lanes][2];
};

}  // namespace tagrid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
