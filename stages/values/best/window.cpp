#include "stages/values/best/window.h"

#include <cstdlib>
#include <span>

#include "stages/sample/vector_code.h"

namespace tagrid {

/// Adds the rows, each multiplied by its weight, four at a time. REQUIRES: the number of rows is a multiple
/// of four.
TAGRID_VECTOR_CODE
void add_weighted(std::span<const std::int16_t* const> rows, std::span<const std::int16_t> weights,
                  std::span<std::int32_t> sums) {
  for (std::size_t t = 0; t < rows.size(); t += 4) {
    const std::int16_t *a = rows[t], *b = rows[t + 1], *c = rows[t + 2], *d = rows[t + 3];
    const std::int16_t wa = weights[t], wb = weights[t + 1], wc = weights[t + 2], wd = weights[t + 3];
    std::int32_t* sum = sums.data();
    const std::size_t length = sums.size();
    for (std::size_t x = 0; x < length; ++x) sum[x] += (wa * a[x] + wb * b[x]) + (wc * c[x] + wd * d[x]);
  }
}

void VoxelWindow::begin_slice(std::int64_t z) {
  z_ = z;
  if (z == 0) return;
  // Above the first row lies the first row of the slice before; below the last row lies the last row again.
  const Value* first = value_row(0, z - 1) - pad;
  for (std::int64_t y = -2; y < 0; ++y) std::copy(first, first + stride_, value_row(y, z) - pad);
  const Value* last = value_row(size_.y - 1, z - 1) - pad;
  std::copy(last, last + stride_, value_row(size_.y, z - 1) - pad);
}

void VoxelWindow::end_row() { here_[size_.x] = here_[size_.x + 1] = here_[size_.x - 1]; }

void VoxelWindow::prepare() {
  if (prepared_) return;
  sum_neighbours();
  measure_residuals();
  prepared_ = true;
}

bool VoxelWindow::is_flat(std::int64_t first, std::int64_t last) const {
  const Value *largest = largest_.data(), *smallest = smallest_.data(), left = here_[first - 1];
  int different = 0;
  for (std::int64_t x = first; x < last; ++x) different |= (largest[x] ^ left) | (smallest[x] ^ left);
  return different == 0;
}

void VoxelWindow::fill(std::int64_t first, std::int64_t last) {
  std::fill(here_ + first, here_ + last, here_[first - 1]);
  std::fill(residual_ + first, residual_ + last, Value{0});
  std::fill(missed_here_ + first, missed_here_ + last, Missed{});
}

void VoxelWindow::sum_neighbours() {
  const Weights& w = z_ == 0 ? parameters_.first_slice : parameters_.others;
  left_weight_ = w.of_tap[0];
  second_weight_ = w.of_tap[1];
  std::array<const Value*, taps.size()> rows;
  std::array<std::int16_t, taps.size()> weights{};
  std::size_t count = 0;
  for (std::size_t t = row_taps; t < static_cast<std::size_t>(z_ == 0 ? slice_taps : all_taps); ++t) {
    weights[count] = static_cast<std::int16_t>(w.of_tap[t]);
    // Two slices before the second one lies the first one again.
    rows[count++] = value_row(y_ + taps[t].dy, std::max<std::int64_t>(z_ + taps[t].dz, 0)) + taps[t].dx;
  }
  while (count % 4 != 0) rows[count++] = above_;  // its weight is 0
  std::fill(sum_.begin(), sum_.end(), parameters_.reference * ((1 << weight_bits) - w.sum()));
  add_weighted({rows.data(), count}, {weights.data(), count}, sum_);
}

TAGRID_VECTOR_CODE
void VoxelWindow::measure_spread() {
  Value *largest = largest_.data(), *smallest = smallest_.data();
  const std::int64_t length = size_.x;
  for (std::int64_t x = 0; x < length; ++x) {
    largest[x] = std::max(std::max(above_[x - 1], above_[x]), above_[x + 1]);
    smallest[x] = std::min(std::min(above_[x - 1], above_[x]), above_[x + 1]);
  }
  if (z_ == 0) return;
  const Value *b = behind_, *below = value_row(y_ + 1, z_ - 1);
  for (std::int64_t x = 0; x < length; ++x) {
    largest[x] = std::max(std::max(largest[x], b[x]), std::max(b[x + 1], below[x]));
    smallest[x] = std::min(std::min(smallest[x], b[x]), std::min(b[x + 1], below[x]));
  }
}

TAGRID_VECTOR_CODE
void VoxelWindow::measure_residuals() {
  std::uint16_t* energy = energy_.data();
  const Value *n = residual_row(y_ - 1, z_), *nn = residual_row(y_ - 2, z_), *p = residual_row(y_, z_ - 1),
              *s = residual_row(y_ + 1, z_ - 1);
  if (y_ == 0) n = nn = p;
  const std::int64_t length = size_.x;
  for (std::int64_t x = 0; x < length; ++x)
    energy[x] = static_cast<std::uint16_t>(3 * std::abs(n[x]) + std::abs(n[x - 1]) + std::abs(n[x + 1]) +
                                           std::abs(nn[x]) + 3 * std::abs(p[x]) + std::abs(p[x + 1]) +
                                           std::abs(s[x]));
  if (z_ == 0)
    for (std::int64_t x = 0; x < length; ++x)
      energy[x] = static_cast<std::uint16_t>(energy[x] + 3 * std::abs(n[x]) + std::abs(n[x - 1]) +
                                             std::abs(n[x + 1]));
  for (std::int64_t x = 0; x < length; ++x)
    class_[static_cast<std::size_t>(x)] = static_cast<std::uint8_t>(
        std::min(static_cast<int>(std::bit_width(std::uint32_t{energy[x]})), 15) / 2 * textures);
}

namespace {

// The taps of the fitted weights, and six more within the window's reach.
constexpr std::array<Tap, features> feature_taps = [] {
  std::array<Tap, features> list{};
  std::copy(taps.begin(), taps.end(), list.begin());
  constexpr std::array<Tap, features - taps.size()> more = {
      {{-1, -2, 0}, {1, -2, 0}, {-2, 0, -1}, {2, 0, -1}, {0, 1, -2}, {0, -1, -2}}};
  std::copy(more.begin(), more.end(), list.begin() + taps.size());
  return list;
}();

int feature_bits_for(const VoxelParameters& p) {
  const auto width = static_cast<int>(std::bit_width(static_cast<std::uint32_t>(p.high - p.low)));
  return std::clamp(feature_bits - width, -3, 4);
}

/// Converts `square` from square sample units to square units of features; never 0.
std::int64_t feature_energy(std::int64_t square, int bits) {
  return 1 + (bits < 0 ? square >> (-2 * bits) : square << (2 * bits));
}

std::int32_t trit(std::int32_t v) { return (v > 0) - (v < 0) + 1; }

/// A difference of predictions in quarters of a step, limited to -7 .. 7, as 0 .. 14.
std::uint32_t quarter_steps(std::int64_t difference, const Quantizer& quantizer) {
  const std::int64_t quarters =
      ((difference >> 5) * static_cast<std::int64_t>(quantizer.reciprocal) + (std::int64_t{1} << 43)) >> 44;
  return static_cast<std::uint32_t>(std::clamp<std::int64_t>(quarters, -7, 7) + 7);
}

}  // namespace

VoxelWindow::VoxelWindow(Index3 size, const VoxelParameters& parameters, std::int64_t error)
    : size_(size),
      parameters_(parameters),
      stride_(size.x + 2 * pad),
      level_scale_(static_cast<std::uint32_t>(
          (std::uint64_t{64} << 16) / (static_cast<std::uint64_t>(parameters.high - parameters.low) + 1))),
      values_(static_cast<std::size_t>(3 * (size.y + 3) * stride_), static_cast<Value>(parameters.reference)),
      residuals_(static_cast<std::size_t>(2 * (size.y + 3) * stride_)),
      largest_(static_cast<std::size_t>(size.x)),
      smallest_(largest_.size()),
      sum_(largest_.size()),
      energy_(largest_.size()),
      class_(largest_.size()),
      feature_bits_(feature_bits_for(parameters)),
      squares_(feature_energy(1 + error * (error + 1) / 3, feature_bits_)),
      gradient_(feature_energy(160, feature_bits_)),
      missed_(static_cast<std::size_t>(2 * (size.y + 3) * stride_)) {}

void VoxelWindow::begin_row(std::int64_t y) {
  y_ = y;
  here_ = value_row(y, z_);
  above_ = value_row(y - 1, z_);
  behind_ = z_ == 0 ? above_ : value_row(y, z_ - 1);
  residual_ = residual_row(y, z_);
  here_[-1] = here_[-2] = y == 0 && z_ > 0 ? behind_[0] : above_[0];
  measure_spread();
  prepared_ = false;
  for (std::size_t t = 0; t < features; ++t) {
    const auto [dx, dy, dz] = feature_taps[t];
    // Nothing lies before the first slice; before the second slice lies the first one,
    // twice.
    feature_rows_[t] =
        (z_ == 0 && dz < 0 ? above_ : value_row(y + dy, std::max<std::int64_t>(z_ + dz, 0))) + dx;
  }
  missed_here_ = missed_row(y, z_);
  missed_above_ = missed_row(y - 1, z_);
  missed_above_2_ = missed_row(y - 2, z_);
  missed_behind_ = missed_row(y, z_ - 1);
  missed_below_ = missed_row(y + 1, z_ - 1);
  residual_above_ = residual_row(y - 1, z_);
  residual_behind_ = residual_row(y, z_ - 1);
  residual_below_ = residual_row(y + 1, z_ - 1);
}

VoxelWindow::MissedSums VoxelWindow::missed_around(std::int64_t x) const {
  MissedSums sums;
  for (std::size_t c = 0; c < candidates; ++c)
    sums[c] = 2u * missed_here_[x - 1][c] + missed_here_[x - 2][c] + 2u * missed_above_[x][c] +
              missed_above_[x - 1][c] + missed_above_[x + 1][c] + missed_above_2_[x][c] +
              2u * missed_behind_[x][c] + missed_behind_[x - 1][c] + missed_behind_[x + 1][c] +
              missed_below_[x][c];
  return sums;
}

void VoxelWindow::find_biases(std::int64_t x, std::int32_t blended, Prediction& p) const {
  const auto i = static_cast<std::size_t>(x);
  const std::int32_t plain = blended >> weight_bits, sign = trit(residual_[x - 1]);
  p.texture = static_cast<std::uint32_t>((above_[x] > plain) | (here_[x - 1] > plain) << 1 |
                                         (behind_[x] > plain) << 2 | sign << 3);
  p.signs = static_cast<std::uint32_t>(
      ((trit(residual_above_[x + 1]) * 3 + trit(residual_above_[x])) * 3 + trit(residual_behind_[x])) * 3 +
      sign);
  p.signs += class_[i] / textures * 81u;
  p.texture += class_[i];
}

BlendedPrediction VoxelWindow::predict(std::int64_t x, const LeftVoxels& before) {
  Prediction p;
  const auto i = static_cast<std::size_t>(x);
  const std::int32_t left = before.value;
  if (largest_[i] == left && smallest_[i] == left) {
    p.value = left;
    p.flat = true;
    return p;
  }
  const std::int32_t low = parameters_.low * (1 << weight_bits), high = parameters_.high * (1 << weight_bits);
  p.fitted = std::clamp(sum_[i] + left_weight_ * left + second_weight_ * before.second_value, low, high);
  const int shift = weight_bits - feature_bits_;
  for (std::size_t t = 0; t < features; ++t)
    features_[t] = std::clamp((feature_rows_[t][x] * (1 << weight_bits) - p.fitted) >> shift, -feature_limit,
                              feature_limit);
  const auto moved = [&](std::int64_t sum, int bits) {
    return static_cast<std::int32_t>(std::clamp<std::int64_t>(p.fitted + (sum >> (bits - shift)), low, high));
  };
  p.gradient = moved(gradient_.predict(features_), GradientDescent::weight_bits);
  p.squares = moved(squares_.predict(features_), RunningLeastSquares::weight_bits);

  // Weights are the inverse cubes of the errors that each candidate had around, of which ten bits are used.
  const MissedSums missed = missed_around(x);
  p.missed = missed[2];
  const int coarser =
      std::max(0, static_cast<int>(std::bit_width(std::max({missed[0], missed[1], missed[2]}))) - 10);
  std::array<std::int64_t, candidates> trust;
  for (std::size_t c = 0; c < candidates; ++c) {
    const std::int64_t m = (missed[c] >> coarser) + 4;
    trust[c] = (std::int64_t{1} << 34) / (m * m * m);
  }
  const std::int64_t away = trust[1] * (p.gradient - p.fitted) + trust[2] * (p.squares - p.fitted);
  const auto blended = static_cast<std::int32_t>(p.fitted + away / (trust[0] + trust[1] + trust[2]));
  find_biases(x, blended, p);
  p.corrected = blended + ((texture_biases_[p.texture].value + sign_biases_[p.signs].value) >> 1);
  p.value =
      std::clamp((p.corrected + (1 << (weight_bits - 1))) >> weight_bits, parameters_.low, parameters_.high);
  return p;
}

void VoxelWindow::commit(std::int64_t x, LeftVoxels& left, const Prediction& p, std::int32_t value,
                         std::int32_t residual, std::int64_t step) {
  keep(x, left, value, residual);
  if (p.flat) {
    missed_here_[x] = {};
    return;
  }
  const std::int32_t truth = value * (1 << weight_bits);
  const auto missed = [truth](std::int32_t candidate) {
    return static_cast<std::uint16_t>(std::min(std::abs(truth - candidate) >> (weight_bits - 4), 65535));
  };
  missed_here_[x] = {missed(p.fitted), missed(p.gradient), missed(p.squares)};
  const int shift = weight_bits - feature_bits_;
  squares_.learn(features_, std::clamp((truth - p.fitted) >> shift, -feature_limit, feature_limit));
  gradient_.learn(features_, (truth - p.gradient) >> shift);
  // An edge is no evidence of a bias elsewhere, so an error is limited to the usual size around it.
  const std::int64_t usual =
      (std::int64_t{energy_[static_cast<std::size_t>(x)]} + 8) * step * (1 << (weight_bits - 3));
  const std::int64_t error = std::clamp<std::int64_t>(truth - p.corrected, -usual, usual);
  texture_biases_[p.texture].learn(error);
  sign_biases_[p.signs].learn(error);
}

MixedContext VoxelWindow::context(std::int64_t x, const LeftVoxels& before, const Prediction& p,
                                  const Quantizer& quantizer) const {
  const auto i = static_cast<std::size_t>(x);
  const auto size = [x](const Value* row, std::int64_t d) {
    return static_cast<std::uint32_t>(std::abs(std::int32_t{row[x + d]}));
  };
  const auto left = static_cast<std::uint32_t>(std::abs(before.residual)),
             second_left = static_cast<std::uint32_t>(std::abs(before.second_residual));
  const std::uint32_t above = size(residual_above_, 0), behind = size(residual_behind_, 0);
  const std::uint32_t energy = energy_[i] + 4 * left + second_left;
  const std::uint32_t fine = log_scale<2>(energy), coarse = std::min(log_scale<1>(energy), 15u);
  const EnergyClass& energy_class = energy_class_table[fine];
  const int k = energy_class.low_bits;
  const std::int32_t top = std::max<std::int32_t>(largest_[i], before.value),
                     bottom = std::min<std::int32_t>(smallest_[i], before.value);
  const auto spread = static_cast<std::uint64_t>(top - bottom);
  const std::uint32_t steps =
      std::min(log_scale<1>(static_cast<std::uint32_t>((spread * 4 * quantizer.reciprocal) >> 40)), 31u);
  const std::uint32_t level = (static_cast<std::uint32_t>(p.value - parameters_.low) * level_scale_) >> 16;
  const auto cap = [k](std::uint32_t v, std::uint32_t most) { return std::min(v >> k, most); };
  // With the bound 0, the direction in which the prediction was rounded matters; else, where it is among the values
  // around.
  std::uint32_t side, off;
  if (quantizer.error == 0) {
    const std::int32_t fraction = std::clamp(p.corrected - p.value * (1 << weight_bits), -1024, 1023);
    side = static_cast<std::uint32_t>(fraction + 1024) >> 8;
    off = std::min(3u, static_cast<std::uint32_t>(std::abs(fraction)) >> 8);
  } else {
    const std::int32_t outside = std::max(p.value - top, bottom - p.value);
    const auto thirds = static_cast<std::uint32_t>(std::clamp(quantizer(3 * outside) + 1, 0, 3));
    side = 2 * p.value < top + bottom ? 3 - thirds : 4 + thirds;
    off = side / 2;
  }
  const auto missed = static_cast<std::uint32_t>((std::uint64_t{p.missed} * 2 * quantizer.reciprocal) >> 44);
  const std::uint32_t sign = static_cast<std::uint32_t>(trit(before.residual));

  MixedContext c;
  c.low_bits = k;
  c.of = {(fine * 3 + sign) * 8 + side,
          (steps * 8 + energy_class.of_8) * 8 + side,
          (level * 8 + energy_class.of_8) * 4 + off,
          ((((cap(left, 3) * 3 + cap(above, 2)) * 3 + cap(behind, 2)) * 3 +
            cap(size(residual_above_, -1) + size(residual_above_, 1), 2)) *
               3 +
           cap(size(residual_behind_, 1) + size(residual_below_, 0), 2)) *
                  8 +
              side,
          (p.texture % textures * 16 + coarse) * 8 + side,
          (quarter_steps(p.squares - p.fitted, quantizer) * 15 +
           quarter_steps(p.gradient - p.fitted, quantizer)) *
                  16 +
              coarse,
          (p.signs % 81 * 8 + energy_class.of_8) * 4 + side / 2,
          std::min(log_scale<2>(missed), 63u) * 8 + side};
  c.energy = fine;
  c.spread = steps * 8 + side;
  return c;
}

}  // namespace tagrid
