#include "stages/running_least_squares.h"

#include <algorithm>

#include "stages/vector_code.h"

namespace tagrid {
namespace {

TAGRID_VECTOR_CODE
std::int64_t weighted_sum(const std::int32_t* f, const std::int32_t* weights) {
  std::int64_t sum = 0;
  for (std::size_t i = 0; i < features; ++i) sum += std::int64_t{f[i]} * weights[i];
  return sum;
}

/// row[j] = row[j] less what is forgotten, and the sum over the voxels of f[i] * f[j]. Within 32 bits: eight
/// products below 2^26.
TAGRID_VECTOR_CODE
void add_products(const Features* voxels, std::size_t count, int forgetting,
                  std::array<std::int64_t, features>* rows) {
  for (std::size_t i = 0; i < features; ++i) {
    std::array<std::int32_t, features> sums{};
    for (std::size_t k = 0; k < count; ++k) {
      const std::int32_t factor = voxels[k][i];
      for (std::size_t j = 0; j < features; ++j) sums[j] += factor * voxels[k][j];
    }
    std::int64_t* row = rows[i].data();
    for (std::size_t j = 0; j < features; ++j) row[j] += sums[j] - (row[j] >> forgetting);
  }
}

TAGRID_VECTOR_CODE
void step(const std::int32_t* f, std::int64_t gain, std::int64_t limit, std::int32_t* weights) {
  for (std::size_t i = 0; i < features; ++i)
    weights[i] = static_cast<std::int32_t>(std::clamp(weights[i] + ((gain * f[i]) >> 8), -limit, limit));
}

}  // namespace

std::int64_t RunningLeastSquares::predict(const Features& f) const {
  return weighted_sum(f.data(), weights_.data());
}

void RunningLeastSquares::learn(const Features& f, std::int32_t target) {
  features_[count_] = f;
  targets_[count_] = target;
  if (++count_ < batch) return;
  count_ = 0;
  add_batch();
  sweep();
}

void RunningLeastSquares::add_batch() {
  add_products(features_.data(), batch, forgetting, products_.data());
  for (std::size_t i = 0; i < features; ++i) {
    std::int64_t sum = 0;
    for (std::size_t k = 0; k < batch; ++k) sum += std::int64_t{features_[k][i]} * targets_[k];
    with_target_[i] += sum - (with_target_[i] >> forgetting);
  }
}

// Sums are below 2^29 * 2^forgetting, weights at most 2^19: what is left below 2^60.
void RunningLeastSquares::sweep() {
  for (std::size_t i = 0; i < features; ++i) {
    const auto& row = products_[i];
    std::int64_t left = with_target_[i] * (1 << weight_bits) - penalty_ * weights_[i];
    for (std::size_t j = 0; j < features; ++j) left -= row[j] * weights_[j];
    weights_[i] = static_cast<std::int32_t>(
        std::clamp<std::int64_t>(weights_[i] + left / (row[i] + penalty_), -limit, limit));
  }
}

std::int64_t GradientDescent::predict(const Features& f) const {
  return weighted_sum(f.data(), weights_.data());
}

void GradientDescent::learn(const Features& f, std::int64_t error) {
  const std::int64_t energy = weighted_sum(f.data(), f.data());
  step(f.data(), error * (1 << 24) / (energy + floor_), limit, weights_.data());
}

}  // namespace tagrid
