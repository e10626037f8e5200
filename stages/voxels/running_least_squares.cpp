#include "stages/voxels/running_least_squares.h"

#include <algorithm>

#include "stages/volume/vector_code.h"

namespace tagrid {
namespace {

TAGRID_VECTOR_CODE
std::int64_t weighted_sum(const std::int32_t* f, const std::int32_t* weights) {
  std::int64_t sum = 0;
  for (std::size_t i = 0; i < features; ++i) sum += std::int64_t{f[i]} * weights[i];
  return sum;
}

/// row[j] loses what is forgotten, and gains the sum over the voxels of f[i] * f[j]. This stays within 32
/// bits: the sum is at most 4 * 4095^2, and as 1/32 is forgotten, a row stays within 32 times as much.
TAGRID_VECTOR_CODE
void add_products(const Features* voxels, std::size_t count, int forgetting,
                  std::array<std::int32_t, features>* rows) {
  for (std::size_t i = 0; i < features; ++i) {
    std::array<std::int32_t, features> sums{};
    for (std::size_t k = 0; k < count; ++k) {
      const std::int32_t factor = voxels[k][i];
      for (std::size_t j = 0; j < features; ++j) sums[j] += factor * voxels[k][j];
    }
    std::int32_t* row = rows[i].data();
    for (std::size_t j = 0; j < features; ++j) row[j] += sums[j] - (row[j] >> forgetting);
  }
}

/// Half a sweep of coordinate descent: every second weight in turn moves to its minimum, with the others
/// fixed. `left` is the negative gradient, without the penalty.
TAGRID_VECTOR_CODE
void descend(std::size_t first, const std::array<std::int32_t, features>* products, std::int64_t penalty,
             std::int64_t limit, std::int64_t* left, std::int32_t* weights) {
  for (std::size_t i = first; i < features; i += 2) {
    const std::int32_t* row = products[i].data();
    const std::int64_t old = weights[i];
    const std::int64_t moved =
        std::clamp(old + (left[i] - penalty * old) / (row[i] + penalty), -limit, limit);
    weights[i] = static_cast<std::int32_t>(moved);
    const auto change = static_cast<std::int32_t>(moved - old);
    for (std::size_t j = 0; j < features; ++j) left[j] -= std::int64_t{row[j]} * change;
  }
}

TAGRID_VECTOR_CODE
void step(const std::int32_t* f, std::int64_t gain, std::int64_t limit, std::int32_t* weights) {
  for (std::size_t i = 0; i < features; ++i)
    weights[i] = static_cast<std::int32_t>(std::clamp(weights[i] + ((gain * f[i]) >> 8), -limit, limit));
}

}  // namespace

std::int64_t RunningLeastSquares::predict(const Features& f) {
  predicted_ = weighted_sum(f.data(), weights_.data());
  return predicted_;
}

void RunningLeastSquares::learn(const Features& f, std::int32_t target) {
  if (count_ == 0)
    for (std::int64_t& g : gradient_) g -= g >> forgetting;
  features_[count_] = f;
  const std::int64_t error = std::int64_t{target} * (1 << weight_bits) - predicted_;
  for (std::size_t i = 0; i < features; ++i) gradient_[i] += error * f[i];
  if (++count_ < batch) return;
  count_ = 0;
  // Products and gradient forget at the same rate, so that both stay sums over the same voxels.
  add_products(features_.data(), batch, forgetting, products_.data());
  descend(turn_, products_.data(), penalty_, limit, gradient_.data(), weights_.data());
  turn_ ^= 1;
}

std::int64_t GradientDescent::predict(const Features& f) const {
  return weighted_sum(f.data(), weights_.data());
}

void GradientDescent::learn(const Features& f, std::int64_t error) {
  const std::int64_t energy = weighted_sum(f.data(), f.data());
  step(f.data(), error * (1 << 24) / (energy + floor_), limit, weights_.data());
}

}  // namespace tagrid
