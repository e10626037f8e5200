// One bit for every lattice point of a box: marks, or activity.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stages/grid/box.h"

namespace tagrid {

/// Bits of the points of `box()`, x fastest. Every row along x starts a new 64-bit word: point x has bit (x -
/// low.x) % 64 of word (x - low.x) / 64 of its row. Bits past the end of a row are always zero.
class LatticeBits {
 public:
  LatticeBits() = default;
  explicit LatticeBits(const Box& box)
      : box_(box),
        words_per_row_(box.empty() ? 0 : static_cast<std::size_t>(box.size().x + 63) / 64),
        words_(box.empty() ? 0 : words_per_row_ * static_cast<std::size_t>(box.size().y * box.size().z)) {}

  const Box& box() const { return box_; }
  std::size_t words_per_row() const { return words_per_row_; }
  std::size_t bytes() const { return words_.size() * sizeof(std::uint64_t); }
  /// The heap that the bits of a box of `size` points take.
  static constexpr std::uint64_t working_bytes(Index3 size) {
    return static_cast<std::uint64_t>((size.x + 63) / 64 * size.y * size.z) * sizeof(std::uint64_t);
  }

  /// The row of points with the given y and z.
  std::uint64_t* row(std::int64_t y, std::int64_t z) { return words_.data() + row_start(y, z); }
  const std::uint64_t* row(std::int64_t y, std::int64_t z) const { return words_.data() + row_start(y, z); }

  /// Where the bit of a point lies, counted from the first bit of words().
  std::size_t bit_of(Index3 p) const {
    return 64 * row_start(p.y, p.z) + static_cast<std::size_t>(p.x - box_.low.x);
  }
  void set(std::size_t bit) { words_[bit / 64] |= std::uint64_t{1} << (bit % 64); }

  bool test(Index3 p) const {
    const std::size_t bit = bit_of(p);
    return (words_[bit / 64] >> (bit % 64)) & 1;
  }
  void set(Index3 p) { set(bit_of(p)); }
  void clear(Index3 p) {
    const std::size_t bit = bit_of(p);
    words_[bit / 64] &= ~(std::uint64_t{1} << (bit % 64));
  }

  std::span<std::uint64_t> words() { return words_; }
  std::span<const std::uint64_t> words() const { return words_; }
  friend bool operator==(const LatticeBits& a, const LatticeBits& b) {
    return a.box_ == b.box_ && a.words_ == b.words_;
  }

 private:
  std::size_t row_start(std::int64_t y, std::int64_t z) const {
    return static_cast<std::size_t>((z - box_.low.z) * box_.size().y + (y - box_.low.y)) * words_per_row_;
  }

  Box box_{{0, 0, 0}, {-1, -1, -1}};
  std::size_t words_per_row_ = 0;
  std::vector<std::uint64_t> words_;
};

/// Calls visit(point, number) for the points whose bits are set, in raster order. `number` is the place of
/// the point among all points of the box. `visit` may clear the bit of its point.
template <class Visit>
void for_each_set(const LatticeBits& bits, Visit visit) {
  const Box& box = bits.box();
  std::size_t row_start = 0;
  for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
    for (std::int64_t y = box.low.y; y <= box.high.y; ++y) {
      const std::uint64_t* const row = bits.row(y, z);
      for (std::size_t w = 0; w < bits.words_per_row(); ++w)
        for (std::uint64_t rest = row[w]; rest != 0; rest &= rest - 1) {
          const std::size_t x = 64 * w + static_cast<std::size_t>(std::countr_zero(rest));
          visit(Index3{box.low.x + static_cast<std::int64_t>(x), y, z}, row_start + x);
        }
      row_start += static_cast<std::size_t>(box.size().x);
    }
}

/// Sets the bits of the corners of root cubes. REQUIRES: the box is one of whole root cubes.
inline void set_root_corners(LatticeBits& bits, int cube_size) {
  for_each_point_of(bits.box(), cube_size, [&](Index3 p) { bits.set(p); });
}

/// Copies the bits of the points in both boxes from `from` into `to`; other bits of `to` stay.
void copy_bits(const LatticeBits& from, LatticeBits& to);
/// The peak of the heap that copy_bits() takes if `points` of a row are shared: a list of the pieces of the
/// row.
std::uint64_t working_bytes_of_copying_bits(std::int64_t points);

}  // namespace tagrid
