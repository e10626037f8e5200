#include "stages/values/best/window.h"

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

}  // namespace tagrid
