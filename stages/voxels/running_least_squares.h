// Least squares over the voxels just coded, in exact integers: weights of the neighbourhood that follow the
// texture from place to place. Sums of products forget slowly, and every few voxels one sweep of coordinate
// descent (the method of Gauss and Seidel) moves the weights towards their solution. An encoder and a decoder
// do the same.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace tagrid {

inline constexpr std::size_t features = 24;
inline constexpr int feature_bits = 12;
/// Largest magnitude of a feature and of a target.
inline constexpr std::int32_t feature_limit = (1 << feature_bits) - 1;

/// Inputs of an adaptive prediction: differences of neighbours from a first guess.
using Features = std::array<std::int32_t, features>;

class RunningLeastSquares {
 public:
  /// `penalty` on the square of a weight: it keeps weights small where little is known. 0 < penalty < 2^40.
  explicit RunningLeastSquares(std::int64_t penalty) : penalty_(penalty) {}

  /// The weighted sum, in 2^-weight_bits of the unit of the features.
  std::int64_t predict(const Features& f);
  /// REQUIRES: f was the last argument of predict().
  void learn(const Features& f, std::int32_t target);

  static constexpr int weight_bits = 16;

 private:
  static constexpr std::size_t batch = 4;                  ///< voxels between two half sweeps
  static constexpr int forgetting = 5;                     ///< a batch takes 2^-forgetting of all sums
  static constexpr std::int32_t limit = 8 << weight_bits;  ///< of a weight's magnitude

  std::int64_t penalty_;
  std::size_t count_ = 0, turn_ = 0;
  std::int64_t predicted_ = 0;
  std::array<Features, batch> features_{};
  std::array<std::array<std::int32_t, features>, features> products_{};
  std::array<std::int64_t, features> gradient_{};
  std::array<std::int32_t, features> weights_{};
};

/// Weights that take a step down the error's gradient at every voxel, its length normalized by the energy of
/// the features (NLMS, B. Widrow and M. Hoff). Quicker to follow than sums of squares, and less precise.
class GradientDescent {
 public:
  /// `floor`: energy that is added to that of the features, > 0.
  explicit GradientDescent(std::int64_t floor) : floor_(floor) {}

  /// In 2^-weight_bits of the unit of the features.
  std::int64_t predict(const Features& f) const;
  /// `error`: what was missed, in the unit of the features, at most 2^15.
  void learn(const Features& f, std::int64_t error);

  static constexpr int weight_bits = 20;

 private:
  static constexpr std::int64_t limit = std::int64_t{8} << weight_bits;

  std::int64_t floor_;
  std::array<std::int32_t, features> weights_{};
};

}  // namespace tagrid
