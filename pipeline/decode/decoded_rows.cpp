#include "pipeline/decode/decoded_rows.h"

#include <cstring>

namespace tagrid {

DecodedRows::DecodedRows(const CodingParameters& parameters, const BrickRows& all, std::int64_t together,
                         std::size_t size)
    : bricks_(parameters.bricks()),
      all_(all),
      together_(together),
      size_(size > 0 ? size : size_of(parameters.type)) {
  begin(all.y_low, all.z_low);
}

double DecodedRows::memory(const CodingParameters& p, std::int64_t together, std::int64_t threads,
                           std::size_t size) {
  constexpr double bytes_of_array = 64;  // a vector in a list, and its block of the heap
  const BrickGrid bricks = p.bricks();
  const auto rows = static_cast<double>(together), edge = static_cast<double>(bricks.length());
  const double row = static_cast<double>(p.dims.x) * static_cast<double>(size > 0 ? size : size_of(p.type));
  return row * std::min(static_cast<double>(p.dims.y), rows * edge + 1) *
             std::min(static_cast<double>(p.dims.z), edge + 1) +
         rows * static_cast<double>(bricks.bricks(0)) * bytes_of_array +
         static_cast<double>(threads) * std::max(static_cast<double>(part_bytes), row);
}

void DecodedRows::begin(std::int64_t y, std::int64_t z) {
  rows_ = {y, std::min(y + together_, all_.y_end), z, z + 1};
  box_ = rows_.owned(bricks_);
}

void DecodedRows::begin_next() {
  samples_.clear();
  samples_.shrink_to_fit();
  if (rows_.y_end < all_.y_end)
    begin(rows_.y_end, rows_.z_low);
  else if (rows_.z_end < all_.z_end)
    begin(all_.y_low, rows_.z_end);
}

std::size_t DecodedRows::slice_bytes() const {
  return static_cast<std::size_t>(box_.size().x * box_.size().y) * size_;
}

DecodedRows::Part DecodedRows::part_with(Index3 p) const {
  assert(complete() && box_.contains(p));
  const std::int64_t brick = (bricks_.owner(p.y) - rows_.y_low) * bricks_.bricks(0) + bricks_.owner(p.x);
  return {owned(brick), samples_[static_cast<std::size_t>(brick)].data()};
}

void DecodedRows::copy_rows(std::int64_t z, std::int64_t y_low, std::int64_t y_high,
                            std::span<std::byte> out) const {
  assert(complete() && box_.contains(Index3{box_.low.x, y_low, z}) &&
         box_.contains(Index3{box_.low.x, y_high, z}));
  const std::int64_t nx = bricks_.bricks(0);
  const std::int64_t first = (bricks_.owner(y_low) - rows_.y_low) * nx,
                     end = (bricks_.owner(y_high) - rows_.y_low + 1) * nx;
  for (std::int64_t brick = first; brick < end; ++brick) {
    const Box box = owned(brick);
    const std::size_t row = static_cast<std::size_t>(box.size().x) * size_;
    const std::int64_t low = std::max(box.low.y, y_low), high = std::min(box.high.y, y_high);
    const std::byte* from = samples_[static_cast<std::size_t>(brick)].data() +
                            static_cast<std::size_t>(box.offset({box.low.x, low, z})) * size_;
    for (std::int64_t y = low; y <= high; ++y, from += row)
      std::memcpy(
          out.data() + static_cast<std::size_t>((y - y_low) * box_.size().x + box.low.x - box_.low.x) * size_,
          from, row);
  }
}

}  // namespace tagrid
