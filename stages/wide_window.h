// The surroundings of the wide voxel that comes next: decoded numbers, residuals and escapes of the last
// three slices, and what they say about it.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "grid/box.h"
#include "stages/wide_prediction.h"
#include "stages/wide_residual_model.h"

namespace tagrid {

struct WidePrediction {
  std::int64_t value = 0;
  std::int32_t fraction = 0;  ///< of the prediction before rounding, in 2^-11, -1024 .. 1023
  std::uint64_t spread = 0;   ///< of the neighbours' numbers; 0: they are all equal
};

/// Everything of one box of `size`, in raster order. Sum is wide enough for weighted sums of numbers.
template <class Sum>
class WideWindow {
 public:
  /// Residuals are remembered up to this size.
  static constexpr std::int64_t residual_limit = std::int64_t{1} << 58;

  WideWindow(Index3 size, std::int64_t reference, std::int64_t low, std::int64_t high)
      : size_(size),
        width_(size.x + 2 * pad),
        reference_(reference),
        low_(low),
        high_(high),
        numbers_(3, std::vector<std::int64_t>(static_cast<std::size_t>(width_ * (size.y + 3)), reference)),
        residuals_(2, std::vector<std::int64_t>(static_cast<std::size_t>(width_ * (size.y + 3)))),
        escapes_(2, std::vector<std::uint8_t>(static_cast<std::size_t>(width_ * (size.y + 3)))) {}

  void begin_slice(std::int64_t z, const WideWeights& weights) {
    z_ = z;
    weights_ = weights;
    if (z > 0) {
      std::rotate(numbers_.begin(), numbers_.begin() + 2, numbers_.end());
      std::swap(residuals_[0], residuals_[1]);
      std::swap(escapes_[0], escapes_[1]);
    }
    if (z == 1) numbers_[2] = numbers_[1];
    for (std::int64_t y = -2; y < 0 && z > 0; ++y)
      std::copy_n(numbers_[1].begin() + start(0), width_, numbers_[0].begin() + start(y));
    std::fill(residuals_[0].begin(), residuals_[0].end(), 0);
    std::fill(escapes_[0].begin(), escapes_[0].end(), std::uint8_t{0});
  }
  void begin_row(std::int64_t y) {
    row_ = start(y) + pad;
    const std::int64_t before = y > 0 ? at(0, -1, 0) : z_ > 0 ? at(0, 0, 1) : reference_;
    numbers_[0][index(-1)] = numbers_[0][index(-2)] = before;
  }
  void end_row() {
    numbers_[0][index(size_.x)] = numbers_[0][index(size_.x + 1)] = numbers_[0][index(size_.x - 1)];
  }
  void end_slice() {
    std::copy_n(numbers_[0].begin() + start(size_.y - 1), width_, numbers_[0].begin() + start(size_.y));
  }

  WidePrediction predict(std::int64_t x) const {
    std::int64_t least = at(x - 1, 0, 0), most = least;
    const auto see = [&](std::int64_t v) { least = std::min(least, v), most = std::max(most, v); };
    see(at(x - 1, -1, 0)), see(at(x, -1, 0)), see(at(x + 1, -1, 0));
    if (z_ > 0) see(at(x, 0, 1)), see(at(x + 1, 0, 1)), see(at(x, 1, 1));
    const std::uint64_t spread = static_cast<std::uint64_t>(most) - static_cast<std::uint64_t>(least);
    if (spread == 0) return {least, 0, 0};
    Sum sum = 0;
    const std::size_t taps = z_ > 0 ? wide_taps.size() : wide_slice_taps;
    for (std::size_t t = 0; t < taps; ++t)
      sum += Sum{weights_[t]} *
             (Sum{at(x + wide_taps[t].dx, wide_taps[t].dy, -wide_taps[t].dz)} - Sum{reference_});
    const Sum exact = sum + Sum{reference_} * (1 << wide_weight_bits);
    const Sum rounded = (exact + (1 << (wide_weight_bits - 1))) >> wide_weight_bits;
    return {static_cast<std::int64_t>(std::clamp<Sum>(rounded, low_, high_)),
            static_cast<std::int32_t>(exact - rounded * (1 << wide_weight_bits)), spread};
  }

  /// `error` is half a step, rounded down.
  WideContext context(std::int64_t x, const WidePrediction& p, std::int64_t error) const {
    const std::uint64_t energy = 4 * size_of_residual(x - 1, 0, 0) + size_of_residual(x - 2, 0, 0) +
                                 3 * size_of_residual(x, -1, 0) + size_of_residual(x - 1, -1, 0) +
                                 size_of_residual(x + 1, -1, 0) + 3 * size_of_residual(x, 0, 1) +
                                 size_of_residual(x + 1, 0, 1) + size_of_residual(x, 1, 1);
    WideContext c;
    c.energy = log_steps<2>(energy);
    const std::uint32_t centre =
        error == 0 ? std::min<std::uint32_t>(3 * static_cast<std::uint32_t>(std::abs(p.fraction)) >> 10, 2)
                   : 0;
    c.second = 3 * log_steps<1>(p.spread / (static_cast<std::uint64_t>(error) + 1)) + centre;
    c.sign = ((trit(x - 1, 0, 0) * 3 + trit(x, -1, 0)) * 3 + trit(x, 0, 1)) * 8 +
             static_cast<std::uint32_t>((p.fraction + 1024) >> 8);
    return c;
  }
  /// Which of the neighbours escaped: left, above, in the slice before.
  std::size_t escape_context(std::int64_t x) const {
    return escapes_[0][index(x - 1)] + 2U * escapes_[0][index(x, -1)] + 4U * escapes_[1][index(x)];
  }

  void commit(std::int64_t x, std::int64_t number, std::int64_t residual, bool escaped) {
    numbers_[0][index(x)] = number;
    residuals_[0][index(x)] = std::clamp(residual, -residual_limit, residual_limit);
    escapes_[0][index(x)] = escaped;
  }

 private:
  static constexpr std::int64_t pad = 2;

  std::int64_t start(std::int64_t y) const { return (y + 2) * width_; }
  std::size_t index(std::int64_t x, std::int64_t dy = 0) const {
    return static_cast<std::size_t>(row_ + dy * width_ + x);
  }
  std::int64_t at(std::int64_t x, std::int64_t dy, int slices_before) const {
    return numbers_[static_cast<std::size_t>(slices_before)][index(x, dy)];
  }
  std::int64_t residual(std::int64_t x, std::int64_t dy, int slices_before) const {
    return residuals_[static_cast<std::size_t>(slices_before)][index(x, dy)];
  }
  std::uint64_t size_of_residual(std::int64_t x, std::int64_t dy, int slices_before) const {
    return static_cast<std::uint64_t>(std::abs(residual(x, dy, slices_before)));
  }
  std::uint32_t trit(std::int64_t x, std::int64_t dy, int slices_before) const {
    const std::int64_t r = residual(x, dy, slices_before);
    return r < 0 ? 0 : r == 0 ? 1 : 2;
  }

  Index3 size_;
  std::int64_t width_, reference_, low_, high_;
  std::int64_t z_ = 0, row_ = 0;
  WideWeights weights_{};
  std::vector<std::vector<std::int64_t>> numbers_;    ///< [slices before][row start + x + pad]
  std::vector<std::vector<std::int64_t>> residuals_;  ///< 0 outside of the box
  std::vector<std::vector<std::uint8_t>> escapes_;
};

}  // namespace tagrid
