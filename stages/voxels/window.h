// The voxels already coded that the coder of a brick's values keeps: the latest slices of values and
// residuals, padded so that the innermost loop needs no border tests. From them come the prediction and the
// coding context of the next voxel of a row.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <vector>

#include "stages/grid/box.h"
#include "stages/prediction/parameters.h"
#include "stages/voxels/residual_model.h"

namespace tagrid {

struct Prediction {
  std::int32_t value = 0;     ///< clamped to the range
  std::int32_t fraction = 0;  ///< remainder of the rounding, in 2^-weight_bits
  std::uint32_t bias = 0;     ///< neighbours that exceed the prediction, class of the residuals around
  bool flat = false;
};

/// The neighbours to the left of a voxel in its row. They are in registers, since every voxel waits for the
/// one before.
struct LeftVoxels {
  std::int32_t value, second_value;        ///< of the voxels x - 1, x - 2
  std::int32_t residual, second_residual;  ///< as stored in the window
};

class VoxelWindow {
 public:
  using Value = std::int16_t;
  using Prediction = tagrid::Prediction;
  using Context = ResidualContext;

  /// `error` is for windows that adapt: the smallest bound of any voxel.
  VoxelWindow(Index3 size, const VoxelParameters& parameters, std::int64_t error = 0);

  /// The heap of the window for a box of `size` voxels.
  static constexpr std::uint64_t working_bytes(Index3 size) {
    const auto slice = static_cast<std::uint64_t>((size.x + 2 * pad) * (size.y + 3));
    return 5 * slice * sizeof(Value) + static_cast<std::uint64_t>(size.x) * row_bytes;
  }

  void begin_slice(std::int64_t z);
  void begin_row(std::int64_t y);
  void end_row();

  /// True if all neighbours of the voxels first .. last - 1 are equal, and stay so as long as these voxels
  /// are equal, too. REQUIRES: all voxels before `first` are committed.
  bool is_flat(std::int64_t first, std::int64_t last) const;
  /// Commits the value of the neighbours for the voxels of such a segment. For other segments, call prepare()
  /// first.
  void fill(std::int64_t first, std::int64_t last);
  /// Prepares what the functions below need of the rows before. Call it at least once per row.
  void prepare();

  /// REQUIRES: all voxels before x are committed.
  LeftVoxels left_of(std::int64_t x) const {
    return {here_[x - 1], here_[x - 2], residual_[x - 1], residual_[x - 2]};
  }
  Prediction predict(std::int64_t x, const LeftVoxels& left) const;
  ResidualContext context(std::int64_t x, const LeftVoxels& left, const Prediction& p,
                          const Quantizer& quantizer) const;
  /// Stores the decoded value and the quantized residual of voxel x of the row, and moves `left` on.
  void commit(std::int64_t x, LeftVoxels& left, const Prediction& p, std::int32_t value,
              std::int32_t residual, std::int64_t step);

  const Value* row() const { return here_; }

 protected:
  static constexpr std::int64_t pad = 2;
  static constexpr std::int32_t residual_limit = 4095;
  /// The values stored for each voxel of a row: largest_ to class_.
  static constexpr std::uint64_t row_bytes =
      2 * sizeof(Value) + sizeof(std::int32_t) + sizeof(std::uint16_t) + sizeof(std::uint8_t);
  static constexpr int textures = 24;

  /// The average error of predictions in one context: by texture, within a class of the size of the residuals
  /// around. Without the class, the bias of rough regions would spoil smooth ones.
  struct Bias {
    std::int32_t value = 0;  ///< 2^-weight_bits
    std::uint32_t seen = 0;

    void learn(std::int64_t error) {
      const auto step = static_cast<std::int32_t>((error * adaptation_table[seen]) >> 16);
      // Keeps the sums of a prediction within 32 bits, whatever a damaged stream contains.
      value = std::clamp(value + step, -(1 << 27), 1 << 27);
      seen += seen < 128;
    }
  };

  /// Row y, -2 .. size.y, of slice z or one of the two slices before it (for residuals: one slice). Rows
  /// outside the brick exist as far as a voxel inside can need them.
  Value* value_row(std::int64_t y, std::int64_t z) {
    return values_.data() + (z % 3 * (size_.y + 3) + y + 2) * stride_ + pad;
  }
  Value* residual_row(std::int64_t y, std::int64_t z) {
    return residuals_.data() + ((z + 1) % 2 * (size_.y + 3) + y + 2) * stride_ + pad;
  }
  [[gnu::always_inline]] void keep(std::int64_t x, LeftVoxels& left, std::int32_t value,
                                   std::int32_t residual) {
    const std::int32_t limited = std::clamp(residual, -residual_limit, residual_limit);
    here_[x] = static_cast<Value>(value);
    residual_[x] = static_cast<Value>(limited);
    left = {value, left.value, limited, left.residual};
  }
  void sum_neighbours();
  void measure_spread();
  void measure_residuals();

  Index3 size_;
  VoxelParameters parameters_;
  std::int64_t stride_;
  std::uint32_t level_scale_;  ///< converts a value to one of 64 parts of the range, in 2^-16
  std::int64_t y_ = 0, z_ = 0;

  std::vector<Value> values_, residuals_;
  Value* here_ = nullptr;  ///< the row being coded
  const Value *above_ = nullptr, *behind_ = nullptr;
  Value* residual_ = nullptr;
  std::vector<Value> largest_, smallest_;  ///< of the neighbours in the rows before
  bool prepared_ = false;                  ///< whether the members below are those of the row
  std::int32_t left_weight_ = 0, second_weight_ = 0;
  std::vector<std::int32_t> sum_;      ///< weighted sum of all taps except those in the row
  std::vector<std::uint16_t> energy_;  ///< of the residuals in the rows before
  std::vector<std::uint8_t> class_;    ///< of the energy, times textures

 private:
  std::array<Bias, 8 * textures> biases_{};
};

[[gnu::always_inline]] inline Prediction VoxelWindow::predict(std::int64_t x,
                                                              const LeftVoxels& before) const {
  Prediction p;
  const auto i = static_cast<std::size_t>(x);
  const std::int32_t left = before.value;
  if (largest_[i] == left && smallest_[i] == left) {
    p.value = left;
    p.flat = true;
    return p;
  }
  const std::int32_t exact = sum_[i] + left_weight_ * left + second_weight_ * before.second_value;
  const std::int32_t plain = exact >> weight_bits;
  const int sign = (before.residual > 0) - (before.residual < 0);
  p.bias = static_cast<std::uint32_t>(
      class_[i] + ((above_[x] > plain) | (left > plain) << 1 | (behind_[x] > plain) << 2 | (sign + 1) << 3));
  const std::int32_t corrected = exact + biases_[p.bias].value;
  const std::int32_t rounded = (corrected + (1 << (weight_bits - 1))) >> weight_bits;
  p.fraction = corrected - (rounded << weight_bits);
  p.value = std::clamp(rounded, parameters_.low, parameters_.high);
  return p;
}

[[gnu::always_inline]] inline void VoxelWindow::commit(std::int64_t x, LeftVoxels& left, const Prediction& p,
                                                       std::int32_t value, std::int32_t residual,
                                                       std::int64_t step) {
  keep(x, left, value, residual);
  if (p.flat) return;
  // An edge says nothing about the bias elsewhere, so an error is limited to what is usual around it.
  const std::int64_t usual =
      (std::int64_t{energy_[static_cast<std::size_t>(x)]} + 8) * step * (1 << (weight_bits - 3));
  const std::int64_t error =
      std::clamp((std::int64_t{value} - p.value) * (1 << weight_bits) - p.fraction, -usual, usual);
  biases_[p.bias].learn(error);
}

[[gnu::always_inline]] inline ResidualContext VoxelWindow::context(std::int64_t x, const LeftVoxels& left,
                                                                   const Prediction& p,
                                                                   const Quantizer& quantizer) const {
  const auto i = static_cast<std::size_t>(x);
  const std::int32_t before = left.residual;
  const std::uint32_t energy = log_scale<2>(energy_[i] + 4 * static_cast<std::uint32_t>(std::abs(before)) +
                                            static_cast<std::uint32_t>(std::abs(left.second_residual)));
  const EnergyClass& size = energy_class_table[energy];
  const std::int32_t here = left.value;
  const auto spread = static_cast<std::uint64_t>(std::max<std::int32_t>(largest_[i], here) -
                                                 std::min<std::int32_t>(smallest_[i], here));
  const auto steps = static_cast<std::uint32_t>((spread * 4 * quantizer.reciprocal) >> 40);
  const std::uint32_t level = (static_cast<std::uint32_t>(p.value - parameters_.low) * level_scale_) >> 16;
  ResidualContext c;
  c.low_bits = size.low_bits;
  c.spread = std::min<std::uint32_t>(log_scale<1>(steps), 31) * 8 + size.of_8;
  c.level = (level * 4 + size.of_4) * 4;
  c.flip = false;
  std::int32_t sign = (before > 0) - (before < 0);
  // If the step is small, the direction in which the prediction was rounded matters.
  if (quantizer.error < 2) {
    c.flip = p.fraction < 0;
    c.level += static_cast<std::uint32_t>(std::min(3, std::abs(p.fraction) >> (weight_bits - 3)));
    sign = c.flip ? -sign : sign;
  }
  c.energy = energy * 3 + static_cast<std::uint32_t>(sign + 1);
  return c;
}

}  // namespace tagrid
