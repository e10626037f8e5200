// Least squares over the voxels just coded, in exact integers: weights of the neighborhood that follow the
// texture from place to place. Sums of products forget slowly. Every few voxels, half a sweep of coordinate
// descent (the method of Gauss and Seidel) moves the weights towards their solution. Encoder and decoder
// compute the same.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace tagrid {

inline constexpr std::size_t features = 24;
inline constexpr int feature_bits = 12;
/// Largest magnitude of a feature and of a target.
inline constexpr std::int32_t feature_limit = (1 << feature_bits) - 1;

/// Inputs of an adaptive prediction: differences between neighbors and a first guess.
using Features = std::array<std::int32_t, features>;

class RunningLeastSquares {
 public:
  /// `penalty` applies to the square of a weight, and keeps weights small while little is known. 0 < penalty
  /// < 2^40.
  explicit RunningLeastSquares(std::int64_t penalty);

  /// The weighted sum, in 2^-weight_bits of the unit of the features.
  std::int64_t predict(const Features& f);
  /// REQUIRES: f was the last argument of predict().
  void learn(const Features& f, std::int32_t target);

  static constexpr int weight_bits = 16;
  static constexpr int forgetting = 5;  ///< a batch removes 2^-forgetting of all sums

 private:
  static constexpr std::size_t batch = 4;                  ///< voxels between two half sweeps
  static constexpr std::int32_t limit = 8 << weight_bits;  ///< of a weight's magnitude

  std::int64_t penalty_;
  std::size_t count_ = 0, turn_ = 0;
  std::int64_t predicted_ = 0;
  void (*add_products_)(const std::int16_t (*pairs)[2 * features], std::int32_t (*rows)[features]);
  std::int16_t pairs_[batch / 2][2 * features] = {};  ///< features of two voxels, one beside the other
  std::int32_t products_[features][features] = {};
  std::array<std::int64_t, features> gradient_{};
  std::array<std::int32_t, features> weights_{};
};

/// Weights that take a step down the error's gradient at every voxel; the length of the step is normalized by
/// the energy of the features (NLMS, B. Widrow and M. Hoff). This adapts faster than sums of squares, but is
/// less precise.
class GradientDescent {
 public:
  /// `floor`: added to the energy of the features; > 0.
  explicit GradientDescent(std::int64_t floor) : floor_(floor) {}

  /// In 2^-weight_bits of the unit of the features.
  std::int64_t predict(const Features& f) const;
  /// `error`: the error of the prediction, in the unit of the features, at most 2^15.
  void learn(const Features& f, std::int64_t error);

  static constexpr int weight_bits = 20;

 private:
  static constexpr std::int64_t limit = std::int64_t{8} << weight_bits;

  std::int64_t floor_;
  std::array<std::int32_t, features> weights_{};
};

}  // namespace tagrid
