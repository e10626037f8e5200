#include "stages/values/best/running_least_squares.h"

#include <algorithm>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stages/values/best/running_least_squares.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "stages/sample/instruction_sets.h"
#include "stages/sample/vector_code.h"

HWY_BEFORE_NAMESPACE();
namespace tagrid::HWY_NAMESPACE {

/// row[j] loses what is forgotten, and gains the sum over four voxels of f[i] * f[j]. This stays within 32
/// bits: the sum is at most 4 * 4095^2, and as 1/32 is forgotten, a row stays within 32 times as much.
/// `pairs`: features of two voxels, one beside the other, then those of the other two.
void add_products(const std::int16_t (*pairs)[2 * features], std::int32_t (*rows)[features]) {
  constexpr int forgetting = RunningLeastSquares::forgetting;
#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_SSE4
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::CappedTag<std::int16_t, 16> d;
  const hn::Repartition<std::int32_t, decltype(d)> d32;
  for (std::size_t i = 0; i < features; ++i) {
    std::int32_t first, second;
    std::memcpy(&first, pairs[0] + 2 * i, sizeof first);
    std::memcpy(&second, pairs[1] + 2 * i, sizeof second);
    const auto of_first = hn::BitCast(d, hn::Set(d32, first)),
               of_second = hn::BitCast(d, hn::Set(d32, second));
    for (std::size_t x = 0; x < 2 * features; x += hn::Lanes(d)) {
      // On these machines, the products of two neighbours are added, and `more` stays 0.
      auto more = hn::Zero(d32);
      auto sum =
          hn::ReorderWidenMulAccumulate(d32, hn::LoadU(d, pairs[0] + x), of_first, hn::Zero(d32), more);
      sum = hn::ReorderWidenMulAccumulate(d32, hn::LoadU(d, pairs[1] + x), of_second, sum, more);
      std::int32_t* const row = rows[i] + x / 2;
      const auto before = hn::LoadU(d32, row);
      hn::StoreU(hn::Add(before, hn::Sub(sum, hn::ShiftRight<forgetting>(before))), d32, row);
    }
  }
#else
  for (std::size_t i = 0; i < features; ++i)
    for (std::size_t j = 0; j < features; ++j) {
      std::int32_t sum = 0;
      for (const int pair : {0, 1})
        for (const std::size_t voxel : {0, 1}) sum += pairs[pair][2 * i + voxel] * pairs[pair][2 * j + voxel];
      rows[i][j] += sum - (rows[i][j] >> forgetting);
    }
#endif
}

}  // namespace tagrid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tagrid {
namespace {

TAGRID_VECTOR_CODE
std::int64_t weighted_sum(const std::int32_t* f, const std::int32_t* weights) {
  std::int64_t sum = 0;
  for (std::size_t i = 0; i < features; ++i) sum += std::int64_t{f[i]} * weights[i];
  return sum;
}

TAGRID_VECTOR_CODE
void add_errors(const std::int32_t* f, std::int64_t error, std::int64_t* gradient) {
  for (std::size_t i = 0; i < features; ++i) gradient[i] += error * f[i];
}

/// Half a sweep of coordinate descent: every second weight in turn moves to its minimum, with the others
/// fixed. `left` is the negative gradient, without the penalty.
TAGRID_VECTOR_CODE
void descend(std::size_t first, const std::int32_t (*products)[features], std::int64_t penalty,
             std::int64_t limit, std::int64_t* left, std::int32_t* weights) {
  for (std::size_t i = first; i < features; i += 2) {
    const std::int32_t* row = products[i];
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

RunningLeastSquares::RunningLeastSquares(std::int64_t penalty)
    : penalty_(penalty), add_products_(TAGRID_BEST_VERSION(add_products)) {}

std::int64_t RunningLeastSquares::predict(const Features& f) {
  predicted_ = weighted_sum(f.data(), weights_.data());
  return predicted_;
}

void RunningLeastSquares::learn(const Features& f, std::int32_t target) {
  if (count_ == 0)
    for (std::int64_t& g : gradient_) g -= g >> forgetting;
  for (std::size_t i = 0; i < features; ++i)
    pairs_[count_ / 2][2 * i + count_ % 2] = static_cast<std::int16_t>(f[i]);
  add_errors(f.data(), std::int64_t{target} * (1 << weight_bits) - predicted_, gradient_.data());
  if (++count_ < batch) return;
  count_ = 0;
  // Products and gradient forget at the same rate, so that both stay sums over the same voxels.
  add_products_(pairs_, products_);
  descend(turn_, products_, penalty_, limit, gradient_.data(), weights_.data());
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
#endif
