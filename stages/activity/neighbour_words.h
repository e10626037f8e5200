// Words of the bits of points that are at a fixed distance from the points of a row, and words as bytes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "stages/grid/lattice_bits.h"

namespace tagrid {

using Word = std::uint64_t;

/// Where the bits of the points lie that are one step from the 64 points of a word. Points outside the box
/// have no bit set.
class NeighbourWord {
 public:
  /// `step` from points 64 i .. 64 i + 63 of the row at y, z, in `shape` and all other sets of the same box.
  NeighbourWord(const LatticeBits& shape, std::int64_t y, std::int64_t z, std::size_t i, Index3 step)
      : bits_(static_cast<unsigned>(step.x & 63)) {
    const Box& box = shape.box();
    y += step.y, z += step.z;
    if (y < box.low.y || y > box.high.y || z < box.low.z || z > box.high.z) return;
    const std::ptrdiff_t in_row = static_cast<std::ptrdiff_t>(i) + (step.x >> 6),
                         count = static_cast<std::ptrdiff_t>(shape.words_per_row());
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

/// One byte for each of 64 points, made from eight words: bit k of byte i is bit i of word k.
class BytesOfPoints {
 public:
  using Words = std::array<std::uint64_t, 8>;

  void transpose(const Words& words);
  std::size_t operator[](int i) const { return bytes_[static_cast<std::size_t>(i)]; }

 private:
  alignas(64) std::array<std::uint8_t, 64> bytes_;
};

}  // namespace tagrid
