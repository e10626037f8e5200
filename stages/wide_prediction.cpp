#include "stages/wide_prediction.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

namespace tagrid {
namespace {

constexpr std::size_t most = wide_taps.size();

struct NormalEquations {
  std::array<std::array<double, most>, most> matrix{};
  std::array<double, most> right{};
  double target = 0, count = 0;
};

// In four lanes, in this order on every machine.
double dot(const double* a, const double* b, std::size_t n) {
  double lane[4] = {};
  std::size_t i = 0;
  for (; i + 4 <= n; i += 4)
    for (std::size_t k = 0; k < 4; ++k) lane[k] += a[i + k] * b[i + k];
  for (; i < n; ++i) lane[0] += a[i] * b[i];
  return (lane[0] + lane[1]) + (lane[2] + lane[3]);
}

// The matrix is positive definite by its penalty, but for rounding.
std::array<double, most> solve(NormalEquations e, std::size_t n) {
  auto& a = e.matrix;
  auto& b = e.right;
  for (std::size_t i = 0; i < n; ++i) {
    const double least = 1e-12 * std::max(a[i][i], 1e-3);
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = a[i][j];
      for (std::size_t k = 0; k < j; ++k) sum -= a[i][k] * a[j][k];
      a[i][j] = i == j ? std::sqrt(std::max(sum, least)) : sum / a[j][j];
    }
    double sum = b[i];
    for (std::size_t k = 0; k < i; ++k) sum -= a[i][k] * b[k];
    b[i] = sum / a[i][i];
  }
  for (std::size_t i = n; i-- > 0;) {
    double sum = b[i];
    for (std::size_t k = i + 1; k < n; ++k) sum -= a[k][i] * b[k];
    b[i] = sum / a[i][i];
  }
  return b;
}

// Variance of what the best weights leave.
double unpredicted(NormalEquations e, std::size_t n, double least) {
  for (std::size_t i = 0; i < n; ++i) e.matrix[i][i] += least * e.count;
  const auto w = solve(e, n);
  double explained = 0;
  for (std::size_t i = 0; i < n; ++i) explained += w[i] * e.right[i];
  return std::max(0.0, e.target - explained) / e.count + least;
}

WideWeights quantized(const std::array<double, most>& w, std::size_t n) {
  WideWeights weights{};
  double carried = 0;  // the error of rounding goes to the next weight: the sum stays right
  for (std::size_t i = n; i-- > 0;) {
    const double exact = std::clamp(w[i], -64.0, 64.0) * (1 << wide_weight_bits) + carried;
    const double rounded = std::floor(exact + 0.5);
    carried = exact - rounded;
    weights[i] = static_cast<std::int32_t>(rounded);
  }
  return weights;
}

// Rows around one that is predicted, as differences from the reference.
class Rows {
 public:
  Rows(std::span<const std::int64_t> numbers, Index3 size, std::int64_t reference)
      : numbers_(numbers), size_(size), reference_(reference) {}

  void add(std::int64_t y, std::int64_t z, std::size_t n, NormalEquations& sums) {
    for (std::size_t slot = 0; slot < slots; ++slot)
      if (n > wide_slice_taps || slot < 3)
        load(rows_[slot],
             y + (slot < 3   ? -static_cast<int>(slot)
                  : slot < 6 ? static_cast<int>(slot) - 4
                             : 0),
             z - (slot < 3   ? 0
                  : slot < 6 ? 1
                             : 2));
    const auto first = static_cast<std::size_t>(std::min<std::int64_t>(2, size_.x - 1));
    const auto last = static_cast<std::size_t>(std::max<std::int64_t>(size_.x - 2, std::int64_t(first) + 1));
    std::array<const double*, most> at{};
    for (std::size_t i = 0; i < n; ++i)
      at[i] = rows_[slot_of(wide_taps[i])].data() + pad + first + wide_taps[i].dx;
    const double* target = rows_[0].data() + pad + first;
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j <= i; ++j) sums.matrix[i][j] += dot(at[i], at[j], last - first);
      sums.right[i] += dot(at[i], target, last - first);
    }
    sums.target += dot(target, target, last - first);
    sums.count += static_cast<double>(last - first);
  }

 private:
  static constexpr std::size_t slots = 7, pad = 2;

  static std::size_t slot_of(const WideTap& tap) {
    return static_cast<std::size_t>(tap.dz == 0 ? -tap.dy : tap.dz == -1 ? 4 + tap.dy : 6);
  }
  void load(std::vector<double>& row, std::int64_t y, std::int64_t z) const {
    y = std::clamp<std::int64_t>(y, 0, size_.y - 1);
    z = std::clamp<std::int64_t>(z, 0, size_.z - 1);
    const std::int64_t* from = numbers_.data() + (z * size_.y + y) * size_.x;
    row.resize(static_cast<std::size_t>(size_.x) + 2 * pad);
    for (std::int64_t x = -2; x < size_.x + 2; ++x)
      row[static_cast<std::size_t>(x + 2)] =
          static_cast<double>(from[std::clamp<std::int64_t>(x, 0, size_.x - 1)]) -
          static_cast<double>(reference_);
  }

  std::span<const std::int64_t> numbers_;
  Index3 size_;
  std::int64_t reference_;
  std::array<std::vector<double>, slots> rows_;
};

}  // namespace

std::int64_t magnitude_of(const WideWeights& weights) {
  std::int64_t total = 0;
  for (const std::int32_t w : weights) total += std::abs(std::int64_t{w});
  return total;
}

WideWeights fit_wide_weights(std::span<const std::int64_t> numbers, Index3 size, std::size_t tap_count,
                             std::int64_t reference, double noise) {
  const bool first_slice = tap_count == wide_slice_taps;
  NormalEquations sums;
  Rows rows(numbers, size, reference);
  // Large bricks say the same many times over: a sixteenth of the rows is enough.
  const std::int64_t z_step = size.z >= 16 ? 4 : 1, y_step = size.y >= 16 ? 4 : 1;
  const std::int64_t first_z = first_slice ? 0 : std::min<std::int64_t>(2, size.z - 1);
  const std::int64_t end_z = first_slice ? 1 : size.z;
  std::int64_t turn = 0;
  for (std::int64_t z = first_z; z < end_z; z += z_step, ++turn)
    for (std::int64_t y = std::min<std::int64_t>(2 + turn % y_step, size.y - 1); y < size.y; y += y_step) {
      const std::int64_t* row = numbers.data() + (z * size.y + y) * size.x;
      if (std::all_of(row, row + size.x, [row](std::int64_t v) { return v == *row; })) continue;
      rows.add(y, z, tap_count, sums);
    }
  const WideWeights fallback = default_wide_weights();
  if (sums.count == 0) return fallback;
  const double least = std::max(0.05, 1e-9 * sums.target / sums.count);
  const double left = unpredicted(sums, tap_count, least);
  double penalty = sums.count * (least + (noise > 0 ? noise * left / (noise + left) : 0));
  for (int attempt = 0; attempt < 8; ++attempt, penalty *= 16) {
    NormalEquations e = sums;
    for (std::size_t i = 0; i < tap_count; ++i) {
      e.matrix[i][i] += penalty;
      e.right[i] += penalty * fallback[i] / (1 << wide_weight_bits);
    }
    const auto exact = solve(e, tap_count);
    if (!std::all_of(exact.begin(), exact.end(), [](double w) { return std::isfinite(w); })) continue;
    const WideWeights weights = quantized(exact, tap_count);
    if (magnitude_of(weights) <= wide_weight_limit) return weights;
  }
  return fallback;
}

}  // namespace tagrid
