// The surroundings of the next wide voxel: decoded numbers, residuals and escapes of the last three slices,
// and the prediction and contexts that follow from them.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "stages/grid/box.h"
#include "stages/sample/numbers.h"
#include "stages/values/prediction/weights.h"
#include "stages/values/wide/residual_model.h"

namespace tagrid {

/// The average error of predictions in one class of surroundings, in 2^-11.
struct WideBias {
  std::int64_t value = 0;
  std::uint32_t seen = 0;

  void learn(std::int64_t error) {
    constexpr std::int64_t limit = std::int64_t{1} << 40;
    value = std::clamp(value + ((error * adaptation_table[seen]) >> 16), -limit, limit);
    seen += seen < 128;
  }
};

struct WidePrediction {
  std::int64_t value = 0;
  std::int32_t fraction = 0;  ///< remainder of rounding the prediction, in 2^-11, -1024 .. 1023
  std::uint64_t spread = 0;   ///< of the neighbors' numbers; 0: they are all equal
  std::uint64_t before = 0;   ///< weighted sum of the residuals of the rows before
  std::uint32_t texture = 0;  ///< the neighbors above the plain prediction, and a sign; below 24
  std::size_t texture_bias = 0, sign_bias = 0;
};

/// The window of one box of `size`, in raster order. Sum is wide enough for weighted sums of numbers.
template <class Sum>
class WideWindow {
 public:
  /// Residuals are stored up to this magnitude.
  static constexpr std::int64_t residual_limit = std::int64_t{1} << 58;
  static constexpr std::uint64_t bias_limit = std::uint64_t{1} << 13;

  WideWindow(Index3 size, std::int64_t reference, std::int64_t low, std::int64_t high)
      : size_(size),
        width_(size.x + 2 * pad),
        reference_(reference),
        low_(low),
        high_(high),
        numbers_(3, std::vector<std::int64_t>(static_cast<std::size_t>(width_ * (size.y + 3)), reference)),
        residuals_(2, std::vector<std::int64_t>(static_cast<std::size_t>(width_ * (size.y + 3)))),
        escapes_(2, std::vector<std::uint8_t>(static_cast<std::size_t>(width_ * (size.y + 3)))) {}

  /// The heap of the window for a box of `size` voxels.
  static constexpr std::uint64_t working_bytes(Index3 size) {
    const auto slice = static_cast<std::uint64_t>((size.x + 2 * pad) * (size.y + 3));
    // One more slice, while the first three are made as copies.
    return slice * (6 * sizeof(std::int64_t) + 3 * sizeof(std::uint8_t)) + 1024;
  }

  void begin_slice(std::int64_t z, const Weights& weights) {
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
    WidePrediction p;
    p.before = 3 * size_of_residual(x, -1, 0) + size_of_residual(x - 1, -1, 0) +
               size_of_residual(x + 1, -1, 0) + 3 * size_of_residual(x, 0, 1) +
               size_of_residual(x + 1, 0, 1) + size_of_residual(x, 1, 1);
    std::int64_t least = at(x - 1, 0, 0), most = least;
    const auto see = [&](std::int64_t v) { least = std::min(least, v), most = std::max(most, v); };
    see(at(x - 1, -1, 0)), see(at(x, -1, 0)), see(at(x + 1, -1, 0));
    if (z_ > 0) see(at(x, 0, 1)), see(at(x + 1, 0, 1)), see(at(x, 1, 1));
    p.spread = static_cast<std::uint64_t>(most) - static_cast<std::uint64_t>(least);
    if (p.spread == 0) {
      p.value = least;
      return p;
    }
    Sum sum = 0;
    const auto count = static_cast<std::size_t>(z_ > 0 ? all_taps : slice_taps);
    for (std::size_t t = 0; t < count; ++t)
      sum += Sum{weights_.of_tap[t]} * (Sum{at(x + taps[t].dx, taps[t].dy, -taps[t].dz)} - Sum{reference_});
    const Sum exact = sum + Sum{reference_} * (1 << weight_bits);
    const Sum plain = exact >> weight_bits;
    const std::uint32_t sign = trit(x - 1, 0, 0);
    p.texture = (Sum{at(x, -1, 0)} > plain) + 2U * (Sum{at(x - 1, 0, 0)} > plain) +
                4U * (Sum{z_ > 0 ? at(x, 0, 1) : at(x, -1, 0)} > plain) + 8 * sign;
    const std::uint32_t size = std::min<std::uint32_t>(log_steps<0>(p.before), 15) / 2;
    p.texture_bias = 24 * size + p.texture;
    p.sign_bias = 81 * size + 27 * trit(x + 1, -1, 0) + 9 * trit(x, -1, 0) + 3 * trit(x, 0, 1) + sign;
    const Sum corrected = exact + texture_biases_[p.texture_bias].value + sign_biases_[p.sign_bias].value;
    const Sum rounded = (corrected + (1 << (weight_bits - 1))) >> weight_bits;
    p.value = static_cast<std::int64_t>(std::clamp<Sum>(rounded, low_, high_));
    p.fraction = static_cast<std::int32_t>(corrected - rounded * (1 << weight_bits));
    return p;
  }

  /// `error` is half a step, rounded down.
  WideContext context(std::int64_t x, const WidePrediction& p, std::int64_t error) const {
    const std::uint64_t energy = p.before + 4 * size_of_residual(x - 1, 0, 0) + size_of_residual(x - 2, 0, 0);
    const int k = std::max(0, static_cast<int>(std::bit_width(energy >> 4)) - 2);
    const auto cap = [k](std::uint64_t v, std::uint64_t most) {
      return static_cast<std::uint32_t>(std::min(v >> k, most));
    };
    WideContext c;
    c.energy = log_steps<2>(energy);
    const std::uint32_t centre =
        error == 0 ? std::min<std::uint32_t>(3 * static_cast<std::uint32_t>(std::abs(p.fraction)) >> 10, 2)
                   : 0;
    c.views[0] = 3 * log_steps<1>(p.spread / (static_cast<std::uint64_t>(error) + 1)) + centre;
    c.views[1] = (((cap(size_of_residual(x - 1, 0, 0), 3) * 3 + cap(size_of_residual(x, -1, 0), 2)) * 3 +
                   cap(size_of_residual(x, 0, 1), 2)) *
                      3 +
                  cap(size_of_residual(x - 1, -1, 0) + size_of_residual(x + 1, -1, 0), 2)) *
                     3 +
                 cap(size_of_residual(x + 1, 0, 1) + size_of_residual(x, 1, 1), 2);
    const std::uint32_t coarse = std::min<std::uint32_t>(log_steps<0>(energy), 15);
    c.views[2] = 16 * p.texture + coarse;
    c.sign[0] = ((trit(x - 1, 0, 0) * 3 + trit(x, -1, 0)) * 3 + trit(x, 0, 1)) * 8 +
                static_cast<std::uint32_t>((p.fraction + 1024) >> 8);
    c.sign[1] = ((trit(x - 1, -1, 0) * 3 + trit(x + 1, -1, 0)) * 3 + trit(x + 1, 0, 1)) * 8 + p.texture % 8;
    return c;
  }
  /// Which of the neighbors escaped: left, above, and in the slice before.
  std::size_t escape_context(std::int64_t x) const {
    return escapes_[0][index(x - 1)] + 2U * escapes_[0][index(x, -1)] + 4U * escapes_[1][index(x)];
  }

  void commit(std::int64_t x, const WidePrediction& p, std::int64_t number, std::int64_t residual,
              std::int64_t step) {
    store(x, number, residual, false);
    // Very large residuals are mere noise, and the bias would be, too.
    if (p.spread == 0 || p.before >= bias_limit) return;
    constexpr Int128 limit = Int128{1} << 40;
    const Int128 usual = std::min(Int128{p.before + 8} * step * 256, limit);
    const auto error = static_cast<std::int64_t>(
        std::clamp((Int128{number} - p.value) * (1 << weight_bits) - p.fraction, -usual, usual));
    texture_biases_[p.texture_bias].learn(error);
    sign_biases_[p.sign_bias].learn(error);
  }
  /// A voxel whose sample has no number counts as its prediction.
  void commit_escape(std::int64_t x, const WidePrediction& p) { store(x, p.value, 0, true); }

 private:
  static constexpr std::int64_t pad = 2;

  void store(std::int64_t x, std::int64_t number, std::int64_t residual, bool escaped) {
    numbers_[0][index(x)] = number;
    residuals_[0][index(x)] = std::clamp(residual, -residual_limit, residual_limit);
    escapes_[0][index(x)] = escaped;
  }
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
  Weights weights_;
  std::array<WideBias, 8 * 24> texture_biases_{};
  std::array<WideBias, 8 * 81> sign_biases_{};
  std::vector<std::vector<std::int64_t>> numbers_;    ///< [slices before][row start + x + pad]
  std::vector<std::vector<std::int64_t>> residuals_;  ///< 0 outside the box
  std::vector<std::vector<std::uint8_t>> escapes_;
};

}  // namespace tagrid
