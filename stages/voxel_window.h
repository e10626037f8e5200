// What the coder of a brick's values keeps of the voxels already coded: a window of three slices of values
// and two of residuals, padded so that the innermost loop has no border tests, and from them the prediction
// and the coding context of the next voxel.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <vector>

#include "grid/box.h"
#include "stages/prediction.h"
#include "stages/residual_coding.h"

namespace tagrid {

/// How samples of 8 and 16 bits are held while coding: as int16, sums in 32 bits (see weight_limit).
template <class T>
struct Held {
  using Value = std::int16_t;
  using Sum = std::int32_t;
  static constexpr std::int32_t offset = std::is_same_v<T, std::uint16_t> ? 32768 : 0;
  static Value from(T sample) { return static_cast<Value>(std::int32_t{sample} - offset); }
  static T to(std::int32_t value) { return static_cast<T>(value + offset); }
};

/// Quantization with the step 2E + 1: every difference is within E of a multiple of the step.
struct Quantizer {
  std::int64_t error = 0;
  std::int64_t step = 1;
  std::uint64_t reciprocal = (std::uint64_t{1} << 40) + 1;

  Quantizer() = default;
  /// REQUIRES: 0 <= max_error <= 65535. Then the multiplication below divides exactly.
  explicit Quantizer(std::int64_t max_error)
      : error(max_error),
        step(2 * max_error + 1),
        reciprocal((std::uint64_t{1} << 40) / static_cast<std::uint64_t>(step) + 1) {}

  std::int32_t operator()(std::int32_t difference) const {
    const auto magnitude = static_cast<std::uint64_t>(difference < 0 ? -difference : difference);
    const auto q =
        static_cast<std::int32_t>(((magnitude + static_cast<std::uint64_t>(error)) * reciprocal) >> 40);
    return difference < 0 ? -q : q;
  }
};

/// Stored with every brick that is not constant; values as held.
struct VoxelParameters {
  std::int32_t low = 0, high = 0;  ///< range of the originals
  std::int32_t reference = 0;      ///< what the weights apply to differences from
  Weights first_slice, others;
};

struct Prediction {
  std::int32_t value = 0;     ///< within the range
  std::int32_t fraction = 0;  ///< what rounding took away, 2^-weight_bits
  std::uint8_t bias = 0;      ///< which neighbours exceed the prediction, in a class of residuals around
  bool flat = false;
};

class VoxelWindow {
 public:
  using Value = std::int16_t;

  VoxelWindow(Index3 size, const VoxelParameters& parameters);

  void begin_slice(std::int64_t z);
  void begin_row(std::int64_t y);
  void end_row();
  void end_slice();

  Prediction predict(std::int64_t x) const;
  /// Takes the decoded value and the quantized residual of voxel x of the row.
  void commit(std::int64_t x, const Prediction& p, std::int32_t value, std::int32_t residual,
              std::int64_t step);
  /// REQUIRES: all voxels before x are committed.
  ResidualContext context(std::int64_t x, const Prediction& p, const Quantizer& quantizer) const;

  const Value* row() const { return here_; }

 private:
  static constexpr std::int64_t pad = 2;
  static constexpr std::int32_t residual_limit = 4095;

  /// What predictions in one context have missed on average: the window keeps them by the texture, within a
  /// class of how large the residuals around are. Without the class the bias of rough regions would spoil
  /// smooth ones.
  struct Bias {
    std::int32_t value = 0;  ///< 2^-weight_bits
    std::uint32_t seen = 0;

    void learn(std::int64_t error) {
      const auto step = static_cast<std::int32_t>((error * adaptation_table[seen]) >> 16);
      // Keeps the sums of a prediction within 32 bits whatever a damaged stream says.
      value = std::clamp(value + step, -(1 << 27), 1 << 27);
      if (seen < 128) ++seen;
    }
  };

  Value* value_row(std::int64_t y, std::int64_t slice) {
    return values_.data() + ((slice + 3) % 3 * (size_.y + 3) + y + 2) * stride_ + pad;
  }
  Value* residual_row(std::int64_t y, std::int64_t slice) {
    return residuals_.data() + ((slice + 2) % 2 * (size_.y + 3) + y + 2) * stride_ + pad;
  }
  void sum_row();
  void spread_row();
  void energy_row();
  void class_row();

  Index3 size_;
  VoxelParameters parameters_;
  std::int64_t stride_;
  std::int64_t z_ = 0, y_ = 0;
  const Weights* weights_ = nullptr;
  std::uint32_t level_scale_;

  std::vector<Value> values_, residuals_;
  Value* here_ = nullptr;  ///< the row being coded
  const Value *above_ = nullptr, *behind_ = nullptr;
  Value* residual_ = nullptr;
  const Value *residual_above_ = nullptr, *residual_behind_ = nullptr, *residual_behind_below_ = nullptr;
  std::vector<std::int32_t> sum_;  ///< weighted sum of all taps but those in the row
  std::vector<Value> largest_, smallest_;
  std::vector<std::uint16_t> energy_;
  static constexpr int textures = 24;
  std::array<Bias, 8 * textures> biases_{};
  std::vector<std::uint8_t> class_;  ///< of the energy, times textures
};

inline Prediction VoxelWindow::predict(std::int64_t x) const {
  Prediction p;
  const std::int32_t left = here_[x - 1];
  if (largest_[static_cast<std::size_t>(x)] == left && smallest_[static_cast<std::size_t>(x)] == left) {
    p.value = left;
    p.flat = true;
    return p;
  }
  const std::int32_t exact =
      sum_[static_cast<std::size_t>(x)] + weights_->of_tap[0] * left + weights_->of_tap[1] * here_[x - 2];
  const std::int32_t plain = exact >> weight_bits;
  const int sign = (residual_[x - 1] > 0) - (residual_[x - 1] < 0);
  p.bias = static_cast<std::uint8_t>(
      class_[static_cast<std::size_t>(x)] +
      ((above_[x] > plain) | (left > plain) << 1 | (behind_[x] > plain) << 2 | (sign + 1) << 3));
  const std::int32_t corrected = exact + biases_[p.bias].value;
  const std::int32_t rounded = (corrected + (1 << (weight_bits - 1))) >> weight_bits;
  p.fraction = corrected - (rounded << weight_bits);
  p.value = std::clamp(rounded, parameters_.low, parameters_.high);
  return p;
}

inline void VoxelWindow::commit(std::int64_t x, const Prediction& p, std::int32_t value,
                                std::int32_t residual, std::int64_t step) {
  here_[x] = static_cast<Value>(value);
  residual_[x] = static_cast<Value>(std::clamp(residual, -residual_limit, residual_limit));
  if (p.flat) return;
  // An edge says nothing of the bias elsewhere: an error counts no more than is usual around it.
  const std::int64_t usual =
      (std::int64_t{energy_[static_cast<std::size_t>(x)]} + 8) * step * (1 << (weight_bits - 3));
  const std::int64_t error =
      std::clamp((std::int64_t{value} - p.value) * (1 << weight_bits) - p.fraction, -usual, usual);
  biases_[p.bias].learn(error);
}

inline ResidualContext VoxelWindow::context(std::int64_t x, const Prediction& p,
                                            const Quantizer& quantizer) const {
  ResidualContext c;
  const auto i = static_cast<std::size_t>(x);
  const std::int32_t before = residual_[x - 1];
  const std::uint32_t energy = energy_[i] + 4 * static_cast<std::uint32_t>(std::abs(before)) +
                               static_cast<std::uint32_t>(std::abs(std::int32_t{residual_[x - 2]}));
  const std::uint32_t coarse = std::min<std::uint32_t>(log_scale<1>(energy), 15);
  const std::int32_t here = here_[x - 1];
  const auto spread = static_cast<std::uint64_t>(std::max<std::int32_t>(largest_[i], here) -
                                                 std::min<std::int32_t>(smallest_[i], here));
  const auto steps = static_cast<std::uint32_t>((spread * 4 * quantizer.reciprocal) >> 40);
  const auto level = (static_cast<std::uint32_t>(p.value - parameters_.low) * level_scale_) >> 16;
  // Where the step is small, the side to which the prediction was rounded matters.
  const bool fine = quantizer.error < 2;
  const std::uint32_t off_centre = fine ? std::min(3, std::abs(p.fraction) >> (weight_bits - 3)) : 0;
  c.flip = fine && p.fraction < 0;
  const int sign = c.flip ? (before < 0) - (before > 0) : (before > 0) - (before < 0);
  c.low_bits = static_cast<std::uint8_t>(low_bits_for(energy));
  c.energy = static_cast<std::uint16_t>(log_scale<2>(energy) * 3 + static_cast<std::uint32_t>(sign + 1));
  c.spread = static_cast<std::uint16_t>(std::min<std::uint32_t>(log_scale<1>(steps), 31) * 8 + coarse / 2);
  c.level = static_cast<std::uint16_t>((level * 4 + coarse / 4) * 4 + off_centre);
  return c;
}

}  // namespace tagrid
