// Words of the bits of points that are at a fixed distance from the points of a row.
#pragma once

#include <cstddef>
#include <cstdint>

#include "stages/grid/lattice_bits.h"

namespace tagrid {

using Word = std::uint64_t;

/// A distance along x, as words and bits.
struct Shift {
  std::ptrdiff_t words;
  unsigned bits;

  explicit Shift(std::int64_t points) : words(points >> 6), bits(static_cast<unsigned>(points & 63)) {}
};

/// A row of a set of bits; points outside the box have no bit set.
class NeighbourRow {
 public:
  /// The row through p; its x does not matter.
  NeighbourRow(const LatticeBits& bits, Index3 p)
      : count_(static_cast<std::ptrdiff_t>(bits.words_per_row())) {
    const Box& box = bits.box();
    if (p.y >= box.low.y && p.y <= box.high.y && p.z >= box.low.z && p.z <= box.high.z)
      row_ = bits.row(p.y, p.z);
  }

  /// The bits of points 64 i .. 64 i + 63 of the row.
  Word word(std::size_t i) const { return row_ == nullptr ? 0 : row_[i]; }
  /// The bits of the points that are `shift` further along x.
  Word word(std::size_t i, Shift shift) const {
    if (row_ == nullptr) return 0;
    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(i) + shift.words;
    const Word lower = at >= 0 && at < count_ ? row_[at] : 0;
    if (shift.bits == 0) return lower;
    const Word upper = at + 1 >= 0 && at + 1 < count_ ? row_[at + 1] : 0;
    return lower >> shift.bits | upper << (64 - shift.bits);
  }

 private:
  const Word* row_ = nullptr;
  std::ptrdiff_t count_ = 0;
};

/// The same for several sets of bits of one box: where a word with its shift lies.
class NeighbourWord {
 public:
  /// Of the points that are `step` from points 64 i .. 64 i + 63 of the row at y, z. `box` and `words_per_row`
  /// are those of the sets.
  NeighbourWord(const Box& box, std::size_t words_per_row, std::int64_t y, std::int64_t z, std::size_t i,
                Index3 step)
      : bits_(static_cast<unsigned>(step.x & 63)) {
    y += step.y, z += step.z;
    if (y < box.low.y || y > box.high.y || z < box.low.z || z > box.high.z) return;
    const std::ptrdiff_t in_row = static_cast<std::ptrdiff_t>(i) + (step.x >> 6),
                         count = static_cast<std::ptrdiff_t>(words_per_row);
    at_ = ((z - box.low.z) * box.size().y + (y - box.low.y)) * count + in_row;
    has_lower_ = in_row >= 0 && in_row < count;
    has_upper_ = bits_ != 0 && in_row + 1 >= 0 && in_row + 1 < count;
  }

  Word of(const LatticeBits& bits) const {
    const Word* words = bits.words().data();
    return (has_lower_ ? words[at_] >> bits_ : 0) | (has_upper_ ? words[at_ + 1] << (64 - bits_) : 0);
  }

 private:
  std::ptrdiff_t at_ = 0;
  unsigned bits_;
  bool has_lower_ = false, has_upper_ = false;
};

}  // namespace tagrid
