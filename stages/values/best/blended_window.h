// The window of the voxel coder for the best effort. Three predictions of a voxel are blended by how well
// each did around it, and the result is corrected by two biases. Two of the predictions learn from voxel to
// voxel.
#pragma once

#include "stages/bound/bounds.h"
#include "stages/values/best/residual_model.h"
#include "stages/values/best/running_least_squares.h"
#include "stages/values/best/window.h"

namespace tagrid {

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

class BlendedWindow : public VoxelWindow {
 public:
  using Prediction = BlendedPrediction;
  using Context = MixedContext;

  /// `error`: the smallest bound of any voxel.
  BlendedWindow(Index3 size, const VoxelParameters& parameters, std::int64_t error);

  /// The heap of the window for a box of `size` voxels.
  static constexpr std::uint64_t working_bytes(Index3 size) {
    const auto slice = static_cast<std::uint64_t>((size.x + 2 * pad) * (size.y + 3));
    return VoxelWindow::working_bytes(size) + 2 * slice * sizeof(Missed);
  }

  void begin_row(std::int64_t y);
  void fill(std::int64_t first, std::int64_t last);
  Prediction predict(std::int64_t x, const LeftVoxels& left);
  MixedContext context(std::int64_t x, const LeftVoxels& left, const Prediction& p,
                       const Quantizer& quantizer) const;
  /// REQUIRES: p is the last result of predict().
  void commit(std::int64_t x, LeftVoxels& left, const Prediction& p, std::int32_t value,
              std::int32_t residual, std::int64_t step);

 private:
  static constexpr std::size_t candidates = 3;
  using Missed = std::array<std::uint16_t, candidates>;  ///< error of each candidate, in 1/16 of a unit
  using MissedSums = std::array<std::uint32_t, candidates>;

  Missed* missed_row(std::int64_t y, std::int64_t z) {
    return missed_.data() + ((z + 1) % 2 * (size_.y + 3) + y + 2) * stride_ + pad;
  }
  MissedSums missed_around(std::int64_t x) const;
  void find_biases(std::int64_t x, std::int32_t blended, Prediction& p) const;

  int feature_bits_;  ///< fraction bits of a feature; may be negative
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
