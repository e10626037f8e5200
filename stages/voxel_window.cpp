#include "stages/voxel_window.h"

namespace tagrid {

VoxelWindow::VoxelWindow(Index3 size, const VoxelParameters& parameters)
    : size_(size),
      parameters_(parameters),
      stride_(size.x + 2 * pad),
      level_scale_(static_cast<std::uint32_t>(
          (std::uint64_t{64} << 16) / (static_cast<std::uint64_t>(parameters.high - parameters.low) + 1))),
      values_(static_cast<std::size_t>(3 * (size.y + 3) * stride_), static_cast<Value>(parameters.reference)),
      residuals_(static_cast<std::size_t>(2 * (size.y + 3) * stride_)),
      sum_(static_cast<std::size_t>(size.x)),
      largest_(sum_.size()),
      smallest_(sum_.size()),
      energy_(sum_.size()),
      class_(sum_.size()) {}

void VoxelWindow::begin_slice(std::int64_t z) {
  z_ = z;
  weights_ = z == 0 ? &parameters_.first_slice : &parameters_.others;
  if (z == 0) return;
  // Above the first row lies the first row of the slice before.
  const Value* source = value_row(0, z - 1) - pad;
  for (std::int64_t y = -2; y < 0; ++y) std::copy(source, source + stride_, value_row(y, z) - pad);
}

void VoxelWindow::begin_row(std::int64_t y) {
  y_ = y;
  here_ = value_row(y, z_);
  above_ = value_row(y - 1, z_);
  behind_ = z_ == 0 ? above_ : value_row(y, z_ - 1);
  residual_ = residual_row(y, z_);
  residual_above_ = residual_row(y - 1, z_);
  residual_behind_ = residual_row(y, z_ - 1);
  residual_behind_below_ = residual_row(y + 1, z_ - 1);
  here_[-1] = here_[-2] = y == 0 && z_ > 0 ? behind_[0] : above_[0];
  sum_row();
  spread_row();
  energy_row();
  class_row();
}

void VoxelWindow::end_row() { here_[size_.x] = here_[size_.x + 1] = here_[size_.x - 1]; }

void VoxelWindow::end_slice() {
  const Value* last = value_row(size_.y - 1, z_) - pad;
  std::copy(last, last + stride_, value_row(size_.y, z_) - pad);
  if (z_ > 0) return;
  // Two slices before the second one lies the first one again.
  const Value* first = value_row(-2, 0) - pad;
  std::copy(first, first + (size_.y + 3) * stride_, value_row(-2, 2) - pad);
}

void VoxelWindow::sum_row() {
  const Weights& w = *weights_;
  const auto constant = parameters_.reference * ((1 << weight_bits) - w.sum());
  std::fill(sum_.begin(), sum_.end(), constant);
  std::int32_t* sum = sum_.data();
  const int count = z_ == 0 ? slice_taps : all_taps;
  for (int t = row_taps; t < count; ++t) {
    const auto& tap = taps[static_cast<std::size_t>(t)];
    const auto weight = static_cast<std::int16_t>(w.of_tap[static_cast<std::size_t>(t)]);
    if (weight == 0) continue;
    const Value* from = value_row(y_ + tap.dy, z_ + tap.dz) + tap.dx;
    for (std::int64_t x = 0; x < size_.x; ++x) sum[x] += weight * from[x];
  }
}

void VoxelWindow::spread_row() {
  Value* largest = largest_.data();
  Value* smallest = smallest_.data();
  const Value* above = above_;
  for (std::int64_t x = 0; x < size_.x; ++x) {
    largest[x] = std::max(std::max(above[x - 1], above[x]), above[x + 1]);
    smallest[x] = std::min(std::min(above[x - 1], above[x]), above[x + 1]);
  }
  if (z_ == 0) return;
  const Value *b = behind_, *below = value_row(y_ + 1, z_ - 1);
  for (std::int64_t x = 0; x < size_.x; ++x) {
    largest[x] = std::max(std::max(largest[x], b[x]), std::max(b[x + 1], below[x]));
    smallest[x] = std::min(std::min(smallest[x], b[x]), std::min(b[x + 1], below[x]));
  }
}

void VoxelWindow::energy_row() {
  std::uint16_t* energy = energy_.data();
  const Value *n = residual_above_, *nn = residual_row(y_ - 2, z_), *p = residual_behind_,
              *s = residual_behind_below_;
  if (y_ == 0) n = nn = p;
  for (std::int64_t x = 0; x < size_.x; ++x)
    energy[x] = static_cast<std::uint16_t>(3 * std::abs(n[x]) + std::abs(n[x - 1]) + std::abs(n[x + 1]) +
                                           std::abs(nn[x]) + 3 * std::abs(p[x]) + std::abs(p[x + 1]) +
                                           std::abs(s[x]));
  if (z_ > 0) return;
  for (std::int64_t x = 0; x < size_.x; ++x)
    energy[x] =
        static_cast<std::uint16_t>(energy[x] + 3 * std::abs(n[x]) + std::abs(n[x - 1]) + std::abs(n[x + 1]));
}

void VoxelWindow::class_row() {
  for (std::size_t x = 0; x < energy_.size(); ++x)
    class_[x] = static_cast<std::uint8_t>(std::min<unsigned>(log_scale<0>(energy_[x]), 15) / 2 * textures);
}

}  // namespace tagrid
