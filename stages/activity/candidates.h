// Finds the points of a brick that can be active, pass by pass: those whose parents inside the box are
// active. Whole words of points at a time.
#pragma once

#include <cstdint>
#include <vector>

#include "stages/activity/neighbour_words.h"
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
  Candidates(const LatticeBits& active, int cube_size)
      : active_(active), cube_size_(cube_size), bits_(active.box()) {}

  /// The candidates of this pass and of all passes before.
  const LatticeBits& bits() const { return bits_; }
  /// The x coordinates of this pass, as a row of bits.
  const std::vector<Word>& mask() const { return mask_; }

  void find(const Pass& pass) {
    pass_ = pass;
    const Box& box = active_.box();
    const std::int64_t u = pass.unit;
    mask_ = every(2 * u, pass.odd[0] ? u : 0);
    if (pass.odd_count == 3) {
      first_ = every(4 * u, u);
      third_ = every(4 * u, 3 * u);
    }
    for (std::int64_t z = box.low.z + (pass.odd[2] ? u : 0); z <= box.high.z; z += 2 * u)
      for (std::int64_t y = box.low.y + (pass.odd[1] ? u : 0); y <= box.high.y; y += 2 * u)
        if (pass.odd_count < 3)
          find_between(y, z);
        else if (2 * u < cube_size_)
          find_below_edge_midpoints(y, z);
        else
          add(y, z, [&](std::size_t i) { return mask_[i]; });
  }

 private:
  // The points of a row at `start` and at every multiple of `period` from there.
  std::vector<Word> every(std::int64_t period, std::int64_t start) const {
    std::vector<Word> row(active_.words_per_row());
    for (std::int64_t x = start; x < active_.box().size().x; x += period)
      row[static_cast<std::size_t>(x / 64)] |= Word{1} << (x % 64);
    return row;
  }

  template <class WordOf>
  void add(std::int64_t y, std::int64_t z, WordOf word_of) {
    Word* row = bits_.row(y, z);
    for (std::size_t i = 0; i < mask_.size(); ++i) row[i] |= word_of(i);
  }

  // Face centres and edge midpoints lie between their parents along each axis that is not odd.
  void find_between(std::int64_t y, std::int64_t z) {
    const std::int64_t u = pass_.unit;
    const Box& box = active_.box();
    const auto row_at = [&](std::int64_t dy, std::int64_t dz) {
      return NeighbourRow(active_, {0, y + dy, z + dz});
    };
    // A parent outside the box asks for nothing.
    const NeighbourRow rows[4] = {row_at(-u, 0), row_at(u, 0), row_at(0, -u), row_at(0, u)};
    const NeighbourRow own = row_at(0, 0);
    add(y, z, [&](std::size_t i) {
      Word all = mask_[i];
      if (!pass_.odd[1]) {
        if (y > box.low.y) all &= rows[0].word(i);
        if (y < box.high.y) all &= rows[1].word(i);
      }
      if (!pass_.odd[2]) {
        if (z > box.low.z) all &= rows[2].word(i);
        if (z < box.high.z) all &= rows[3].word(i);
      }
      if (all != 0 && !pass_.odd[0]) {
        const auto last = static_cast<std::size_t>(box.size().x - 1);
        const Word first_of_row = i == 0 ? 1 : 0, last_of_row = i == last / 64 ? Word{1} << (last % 64) : 0;
        all &= (own.word(i, Shift(-u)) | first_of_row) & (own.word(i, Shift(u)) | last_of_row);
      }
      return all;
    });
  }

  // The parents of a cube centre; see parents() in grid/lattice.h. Its cell shares a corner with the cell of
  // the coarser unit; the parents are across the cell from this corner along one axis, and next to it along
  // the others.
  void find_below_edge_midpoints(std::int64_t y, std::int64_t z) {
    const std::int64_t u = pass_.unit;
    const Index3 low = active_.box().low;
    const auto shared = [&](std::int64_t c, std::int64_t from) {
      return ((c - from) & (2 * u)) ? c + u : c - u;
    };
    const std::int64_t near_y = shared(y, low.y), near_z = shared(z, low.z);
    const NeighbourRow across_x(active_, {0, near_y, near_z}), across_y(active_, {0, 2 * y - near_y, near_z}),
        across_z(active_, {0, near_y, 2 * z - near_z});
    const Shift before(-u), after(u);
    add(y, z, [&](std::size_t i) {
      // The shared corner is before the first and the fifth point, and so on, and after the others.
      const Word of_first =
          across_x.word(i, after) & across_y.word(i, before) & across_z.word(i, before) & first_[i];
      const Word of_third =
          across_x.word(i, before) & across_y.word(i, after) & across_z.word(i, after) & third_[i];
      return of_first | of_third;
    });
  }

  const LatticeBits& active_;
  int cube_size_;
  LatticeBits bits_;
  Pass pass_{};
  std::vector<Word> mask_, first_, third_;
};

}  // namespace tagrid
