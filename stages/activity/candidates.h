// Finds the points of a brick that can be active, pass by pass: those whose parents inside the box are
// active.
#pragma once

#include <cstdint>
#include <vector>

#include "stages/grid/lattice_bits.h"

namespace tagrid {

/// All points of one unit with the same odd axes. They are coded in one pass over the box.
struct Pass {
  std::int64_t unit;
  bool odd[3];
  int odd_count;
  int cycle;
};

/// The points of a pass that can be active.
class Candidates {
 public:
  using Word = std::uint64_t;

  Candidates(const LatticeBits& active, int cube_size)
      : active_(active),
        low_(active.box().low),
        high_(active.box().high),
        cube_size_(cube_size),
        bits_(active.box()) {}

  /// The candidates of this pass and of all passes before.
  const LatticeBits& bits() const { return bits_; }
  /// The x coordinates of this pass, as a row of bits.
  const std::vector<Word>& mask() const { return mask_; }

  void find(const Pass& pass) {
    pass_ = pass;
    const std::int64_t u = pass.unit;
    set_mask();
    for (std::int64_t z = low_.z + (pass.odd[2] ? u : 0); z <= high_.z; z += 2 * u)
      for (std::int64_t y = low_.y + (pass.odd[1] ? u : 0); y <= high_.y; y += 2 * u) find_row(y, z);
  }

 private:
  // Sets the bits of the x coordinates of the pass.
  void set_mask() {
    mask_.assign(active_.words_per_row(), 0);
    for (std::int64_t x = pass_.odd[0] ? pass_.unit : 0; x <= high_.x - low_.x; x += 2 * pass_.unit)
      mask_[static_cast<std::size_t>(x / 64)] |= Word{1} << (x % 64);
  }

  void find_row(std::int64_t y, std::int64_t z) {
    Word* row = bits_.row(y, z);
    const std::size_t n = mask_.size();
    const std::int64_t u = pass_.unit;
    for (std::size_t i = 0; i < n; ++i) row[i] |= mask_[i];
    if (pass_.odd_count == 3) {
      if (2 * u < cube_size_) keep_below_edge_midpoints(row, y, z);
      return;
    }
    if (!pass_.odd[0]) keep_where_x_neighbours(row, y, z);
    if (!pass_.odd[1]) {
      if (y > low_.y) keep_where(row, active_.row(y - u, z));
      if (y < high_.y) keep_where(row, active_.row(y + u, z));
    }
    if (!pass_.odd[2]) {
      if (z > low_.z) keep_where(row, active_.row(y, z - u));
      if (z < high_.z) keep_where(row, active_.row(y, z + u));
    }
  }

  // Clears the points of the pass in `row` that are not in `other`; points of other passes stay.
  void keep_where(Word* row, const Word* other) const {
    for (std::size_t i = 0; i < mask_.size(); ++i) row[i] &= other[i] | ~mask_[i];
  }

  void keep_where_x_neighbours(Word* row, std::int64_t y, std::int64_t z) {
    const Word* other = active_.row(y, z);
    const std::size_t n = mask_.size(), whole = static_cast<std::size_t>(pass_.unit) / 64,
                      part = static_cast<std::size_t>(pass_.unit) % 64;
    const std::int64_t last = high_.x - low_.x;
    for (std::size_t i = 0; i < n; ++i) {
      Word below = i >= whole ? other[i - whole] << part : 0;
      if (part != 0 && i > whole) below |= other[i - whole - 1] >> (64 - part);
      Word above = i + whole < n ? other[i + whole] >> part : 0;
      if (part != 0 && i + whole + 1 < n) above |= other[i + whole + 1] << (64 - part);
      // The ends of the row have only one neighbour.
      if (i == 0) below |= 1;
      if (i == static_cast<std::size_t>(last / 64)) above |= Word{1} << (last % 64);
      row[i] &= (below & above) | ~mask_[i];
    }
  }

  // The parents of a cube centre; see parents() in grid/lattice.h.
  void keep_below_edge_midpoints(Word* row, std::int64_t y, std::int64_t z) const {
    const std::int64_t u = pass_.unit;
    const auto shared_corner = [&](std::int64_t c, std::int64_t low) {
      return ((c - low) & (2 * u)) ? c + u : c - u;
    };
    const std::int64_t sy = shared_corner(y, low_.y), sz = shared_corner(z, low_.z);
    for (std::int64_t x = low_.x + u; x <= high_.x; x += 2 * u) {
      const std::int64_t sx = shared_corner(x, low_.x);
      const bool all = active_.test({2 * x - sx, sy, sz}) && active_.test({sx, 2 * y - sy, sz}) &&
                       active_.test({sx, sy, 2 * z - sz});
      if (!all) row[(x - low_.x) / 64] &= ~(Word{1} << ((x - low_.x) % 64));
    }
  }

  const LatticeBits& active_;
  Index3 low_, high_;
  int cube_size_;
  LatticeBits bits_;
  Pass pass_{};
  std::vector<Word> mask_;
};

}  // namespace tagrid
