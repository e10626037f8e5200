#include "stages/values/prediction/weights.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "stages/sample/sample_type.h"
#include "stages/sample/samples.h"
#include "stages/sample/vector_code.h"
#include "stages/values/prediction/products.h"

namespace tagrid {
namespace {

constexpr std::size_t unknowns = taps.size();

struct NormalEquations {
  std::array<std::array<double, unknowns>, unknowns> matrix{};
  std::array<double, unknowns> right{};
  double target = 0;
  double count = 0;
};

/// Rows of samples as differences from the reference, with two more samples on either side.
template <class Number>
class PaddedRows {
 public:
  explicit PaddedRows(std::size_t length) : stride_(length + 4), values_(rows * stride_) {}

  template <class T>
  void load(std::size_t slot, const T* row, std::int64_t reference) {
    Number* target = values_.data() + slot * stride_;
    const std::size_t length = stride_ - 4;
    if constexpr (sizeof(T) <= 2) {
      const auto origin = static_cast<std::int32_t>(reference);
      for (std::size_t x = 0; x < length; ++x) target[x + 2] = static_cast<Number>(row[x] - origin);
    } else {
      const auto origin = static_cast<double>(reference);
      for (std::size_t x = 0; x < length; ++x)
        target[x + 2] = static_cast<Number>(static_cast<double>(row[x]) - origin);
    }
    target[0] = target[1] = target[2];
    target[length + 2] = target[length + 3] = target[length + 1];
  }
  const Number* at(std::size_t slot) const { return values_.data() + slot * stride_ + 2; }
  const Number* of(const Tap& tap) const { return at(slot(tap.dy, tap.dz)) + tap.dx; }

  /// Where the row (y + dy, z + dz) is stored.
  static std::size_t slot(int dy, int dz) {
    return dz == 0 ? static_cast<std::size_t>(-dy) : dz == -1 ? static_cast<std::size_t>(4 + dy) : 6;
  }
  static constexpr std::size_t rows = 7;

 private:
  std::size_t stride_;
  std::vector<Number> values_;
};

}  // namespace

/// Sixteen partial sums, in an order that suits vector registers and that every machine can follow.
TAGRID_VECTOR_CODE
double dot(const double* a, const double* b, std::size_t length) {
  constexpr std::size_t width = 16;
  std::array<double, width> sum{};
  std::size_t x = 0;
  for (; x + width <= length; x += width)
    for (std::size_t k = 0; k < width; ++k) sum[k] += a[x + k] * b[x + k];
  for (; x < length; ++x) sum[0] += a[x] * b[x];
  for (std::size_t k = 1; k < width; ++k) sum[0] += sum[k];
  return sum[0];
}

namespace {

/// Sums of products of all numbers, in doubles.
class InexactSums {
 public:
  using Number = double;
  InexactSums(std::size_t tap_count, std::int64_t) : taps_(tap_count) {}

  /// Adds the samples `first` to `last` - 1 of a row.
  void add(const PaddedRows<double>& rows, std::size_t first, std::size_t last) {
    const std::size_t length = last - first;
    std::array<const double*, unknowns> at{};
    for (std::size_t i = 0; i < taps_; ++i) at[i] = rows.of(taps[i]) + first;
    const double* target = rows.at(0) + first;
    for (std::size_t i = 0; i < taps_; ++i) {
      for (std::size_t j = 0; j <= i; ++j) sums_.matrix[i][j] += dot(at[i], at[j], length);
      sums_.right[i] += dot(at[i], target, length);
    }
    sums_.target += dot(target, target, length);
    sums_.count += static_cast<double>(length);
  }
  NormalEquations result() const { return sums_; }

 private:
  std::size_t taps_;
  NormalEquations sums_;
};

/// The same for small integers: faster, and exact.
class ExactSums {
 public:
  using Number = std::int16_t;
  ExactSums(std::size_t tap_count, std::int64_t magnitude)
      : taps_(tap_count), products_(static_cast<int>(tap_count) + 1, magnitude) {}

  void add(const PaddedRows<std::int16_t>& rows, std::size_t first, std::size_t last) {
    std::int16_t chunk[ProductSums::most_rows][ProductSums::chunk];
    for (std::size_t x = first; x < last; x += ProductSums::chunk) {
      const std::size_t length = std::min<std::size_t>(last - x, ProductSums::chunk);
      for (std::size_t i = 0; i <= taps_; ++i) {
        const std::int16_t* const row = i < taps_ ? rows.of(taps[i]) : rows.at(0);
        if (length < ProductSums::chunk) std::memset(chunk[i], 0, sizeof chunk[i]);
        std::memcpy(chunk[i], row + x, length * sizeof *row);
      }
      products_.add(chunk);
    }
    count_ += last - first;
  }
  NormalEquations result() {
    NormalEquations sums;
    const std::int64_t* total = products_.totals();
    for (std::size_t i = 0; i <= taps_; ++i)
      for (std::size_t j = 0; j <= i; ++j, ++total)
        (i < taps_   ? sums.matrix[i][j]
         : j < taps_ ? sums.right[j]
                     : sums.target) = static_cast<double>(*total);
    sums.count = static_cast<double>(count_);
    return sums;
  }

 private:
  std::size_t taps_, count_ = 0;
  ProductSums products_;
};

/// Cholesky factorization. Except for rounding, the penalty makes the matrix positive definite.
std::array<double, unknowns> solve(NormalEquations e, std::size_t n) {
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

/// The variance that the best weights leave.
double unpredicted(NormalEquations e, std::size_t n, double least) {
  for (std::size_t i = 0; i < n; ++i) e.matrix[i][i] += 0.2 * least * e.count;
  const auto w = solve(e, n);
  double explained = 0;
  for (std::size_t i = 0; i < n; ++i) explained += w[i] * e.right[i];
  return std::max(0.0, e.target - explained) / e.count + least;
}

Weights quantized(const std::array<double, unknowns>& w, std::size_t n) {
  Weights weights;
  // The rounding error is carried to the next weight, so that the sum stays right.
  double carried = 0;
  for (std::size_t i = n; i-- > 0;) {
    const double exact = std::clamp(w[i], -64.0, 64.0) * (1 << weight_bits) + carried;
    const double rounded = std::floor(exact + 0.5);
    carried = exact - rounded;
    weights.of_tap[i] = static_cast<std::int32_t>(rounded);
  }
  return weights;
}

}  // namespace

std::int32_t Weights::sum() const {
  std::int32_t total = 0;
  for (std::int32_t w : of_tap) total += w;
  return total;
}

std::int64_t Weights::magnitude() const {
  std::int64_t total = 0;
  for (std::int32_t w : of_tap) total += std::abs(static_cast<std::int64_t>(w));
  return total;
}

Weights default_weights() {
  Weights weights;
  weights.of_tap[0] = weights.of_tap[2] = 1 << (weight_bits - 1);
  return weights;
}

namespace {

/// Sums over a sixteenth of the rows of a large brick, which is redundant.
template <class Sums, class T>
NormalEquations normal_equations(std::span<const T> samples, Index3 size, int tap_count,
                                 std::int64_t reference, std::int64_t magnitude) {
  const bool first_slice = tap_count == slice_taps;
  PaddedRows<typename Sums::Number> rows(static_cast<std::size_t>(size.x));
  Sums sums(static_cast<std::size_t>(tap_count), magnitude);
  const auto row_at = [&](std::int64_t y, std::int64_t z) {
    y = std::clamp<std::int64_t>(y, 0, size.y - 1);
    z = std::clamp<std::int64_t>(z, 0, size.z - 1);
    return samples.data() + (z * size.y + y) * size.x;
  };
  const std::int64_t first_z = first_slice ? 0 : std::min<std::int64_t>(2, size.z - 1);
  const std::int64_t last_z = first_slice ? 1 : size.z;
  const std::int64_t z_step = size.z >= 16 ? 4 : 1, y_step = size.y >= 16 ? 4 : 1;
  const std::int64_t first_x = std::min<std::int64_t>(2, size.x - 1);
  const std::int64_t last_x = std::max(first_x + 1, size.x - 2);
  std::int64_t turn = 0;
  for (std::int64_t z = first_z; z < last_z; z += z_step, ++turn)
    for (std::int64_t y = std::min<std::int64_t>(2 + turn % y_step, size.y - 1); y < size.y; y += y_step) {
      if (all_equal(std::span(row_at(y, z), static_cast<std::size_t>(size.x)))) continue;
      for (int dy = -2; dy <= 0; ++dy) rows.load(rows.slot(dy, 0), row_at(y + dy, z), reference);
      if (!first_slice) {
        for (int dy = -1; dy <= 1; ++dy) rows.load(rows.slot(dy, -1), row_at(y + dy, z - 1), reference);
        rows.load(rows.slot(0, -2), row_at(y, z - 2), reference);
      }
      sums.add(rows, static_cast<std::size_t>(first_x), static_cast<std::size_t>(last_x));
    }
  return sums.result();
}

}  // namespace

template <class T>
Weights fit_weights(std::span<const T> samples, Index3 size, int tap_count, std::int64_t reference,
                    std::int64_t magnitude, double noise) {
  const auto n = static_cast<std::size_t>(tap_count);
  const NormalEquations sums =
      magnitude <= ProductSums::magnitude_limit
          ? normal_equations<ExactSums>(samples, size, tap_count, reference, magnitude)
          : normal_equations<InexactSums>(samples, size, tap_count, reference, magnitude);
  if (sums.count == 0) return default_weights();

  const Weights fallback = default_weights();
  // Values decoded within a wide bound are closer to the originals than after rounding to the step alone,
  // because a smooth brick predicts itself. So the variance that the originals leave unpredicted limits the
  // noise. For numbers as large as wide samples, such small variances would be lost in rounding.
  const double least = std::max(0.05, 1e-12 * sums.target / sums.count);
  const double left = unpredicted(sums, n, least);
  const double penalty_each = least + (noise > 0 ? noise * left / (noise + left) : 0);
  double penalty = sums.count * penalty_each;
  for (int attempt = 0; attempt < 8; ++attempt, penalty *= 16) {
    NormalEquations e = sums;
    for (std::size_t i = 0; i < n; ++i) {
      e.matrix[i][i] += penalty;
      e.right[i] += penalty * fallback.of_tap[i] / (1 << weight_bits);
    }
    const auto exact = solve(e, n);
    if (!std::all_of(exact.begin(), exact.end(), [](double w) { return std::isfinite(w); })) continue;
    const Weights weights = quantized(exact, n);
    if (weights.magnitude() <= weight_limit) return weights;
  }
  return fallback;
}

#define TAGRID_INSTANTIATE(T) \
  template Weights fit_weights(std::span<const T>, Index3, int, std::int64_t, std::int64_t, double);
TAGRID_FOR_EACH_NARROW_TYPE(TAGRID_INSTANTIATE)
TAGRID_INSTANTIATE(std::int64_t)
#undef TAGRID_INSTANTIATE

}  // namespace tagrid
