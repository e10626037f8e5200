// The voxels already coded that the coder of a brick's values keeps: the latest slices of values and
// residuals, padded so that the innermost loop needs no border tests.
//
// Three predictions of a voxel are blended by how well each did around it, and the result is corrected by two
// biases. Two of the predictions learn from voxel to voxel.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "stages/bound/bounds.h"
#include "stages/grid/box.h"
#include "stages/values/best/residual_model.h"
#include "stages/values/best/running_least_squares.h"
#include "stages/values/prediction/parameters.h"

namespace tagrid {

/// The neighbors to the left of a voxel in its row. They are in registers, since every voxel waits for the
/// one before.
struct LeftVoxels {
  std::int32_t value, second_value;        ///< of the voxels x - 1, x - 2
  std::int32_t residual, second_residual;  ///< as stored in the window
};

/// All numbers but `value` are in 2^-11 of the unit of the samples.
struct BlendedPrediction {
  std::int32_t value = 0;  ///< clamped to the range
  bool flat = false;
  std::int32_t fitted = 0;               ///< by the weights of the brick
  std::int32_t gradient = 0;             ///< by the gradient descent
  std::int32_t squares = 0;              ///< by the running least squares
  std::int32_t corrected = 0;            ///< blended, with biases
  std::uint32_t texture = 0, signs = 0;  ///< index of each bias
  std::uint32_t missed = 0;  ///< errors of the least squares around, in 1/16, with weights that sum to 13
};

class VoxelWindow {
 public:
  using Value = std::int16_t;
  using Prediction = BlendedPrediction;
  using Context = MixedContext;

  /// `error`: the smallest bound of any voxel.
  VoxelWindow(Index3 size, const VoxelParameters& parameters, std::int64_t error);

  /// The heap of the window for a box of `size` voxels.
  static constexpr std::uint64_t working_bytes(Index3 size) {
    const auto slice = static_cast<std::uint64_t>((size.x + 2 * pad) * (size.y + 3));
    return slice * (5 * sizeof(Value) + 2 * sizeof(Missed)) + static_cast<std::uint64_t>(size.x) * row_bytes;
  }

  void begin_slice(std::int64_t z);
  void begin_row(std::int64_t y);
  void end_row();

  /// True if all neighbors of the voxels first .. last - 1 are equal, and stay so as long as these voxels
  /// are equal, too. REQUIRES: all voxels before `first` are committed.
  bool is_flat(std::int64_t first, std::int64_t last) const;
  /// Commits the value of the neighbors for the voxels of such a segment. For other segments, call prepare()
  /// first.
  void fill(std::int64_t first, std::int64_t last);
  /// Prepares what the functions below need of the rows before. Call it at least once per row.
  void prepare();

  /// REQUIRES: all voxels before x are committed.
  LeftVoxels left_of(std::int64_t x) const {
    return {here_[x - 1], here_[x - 2], residual_[x - 1], residual_[x - 2]};
  }
  const Value* row() const { return here_; }

  Prediction predict(std::int64_t x, const LeftVoxels& left);
  MixedContext context(std::int64_t x, const LeftVoxels& left, const Prediction& p,
                       const Quantizer& quantizer) const;
  /// REQUIRES: p is the last result of predict().
  void commit(std::int64_t x, LeftVoxels& left, const Prediction& p, std::int32_t value,
              std::int32_t residual, std::int64_t step);

 private:
  static constexpr std::int64_t pad = 2;
  static constexpr std::int32_t residual_limit = 4095;
  /// The values stored for each voxel of a row: largest_ to class_.
  static constexpr std::uint64_t row_bytes =
      2 * sizeof(Value) + sizeof(std::int32_t) + sizeof(std::uint16_t) + sizeof(std::uint8_t);
  static constexpr int textures = 24;

  static constexpr std::size_t candidates = 3;
  using Missed = std::array<std::uint16_t, candidates>;  ///< error of each candidate, in 1/16 of a unit
  using MissedSums = std::array<std::uint32_t, candidates>;

  /// The average error of predictions in one context: by texture, within a class of the size of the residuals
  /// around. Without the class, smooth regions would get the bias of rough ones.
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
  Missed* missed_row(std::int64_t y, std::int64_t z) {
    return missed_.data() + ((z + 1) % 2 * (size_.y + 3) + y + 2) * stride_ + pad;
  }
  MissedSums missed_around(std::int64_t x) const;
  void find_biases(std::int64_t x, std::int32_t blended, Prediction& p) const;
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
  std::vector<Value> largest_, smallest_;  ///< of the neighbors in the rows before
  bool prepared_ = false;                  ///< whether the members below are those of the row
  std::int32_t left_weight_ = 0, second_weight_ = 0;
  std::vector<std::int32_t> sum_;      ///< weighted sum of all taps except those in the row
  std::vector<std::uint16_t> energy_;  ///< of the residuals in the rows before
  std::vector<std::uint8_t> class_;    ///< of the energy, times textures
  int feature_bits_;                   ///< fraction bits of a feature; may be negative
  std::array<const Value*, features> feature_rows_{};
  Features features_{};
  RunningLeastSquares squares_;
  GradientDescent gradient_;
  std::vector<Missed> missed_;
  Missed* missed_here_ = nullptr;
  const Missed *missed_above_ = nullptr, *missed_above_2_ = nullptr, *missed_behind_ = nullptr,
               *missed_below_ = nullptr;
  const Value *residual_above_ = nullptr, *residual_behind_ = nullptr, *residual_below_ = nullptr;
  std::array<Bias, 8 * 24> texture_biases_{};
  std::array<Bias, 8 * 81> sign_biases_{};
};

}  // namespace tagrid
