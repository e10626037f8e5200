// Finds the points of a brick that can be active, pass by pass: those whose parents inside the box are
// active. Entire words of points at a time.
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
};

/// Calls f(y, z) for every row of a box that has points of a pass.
template <class F>
void for_each_row(const Pass& pass, const Box& box, F f) {
  const std::int64_t u = pass.unit;
  for (std::int64_t z = box.low.z + (pass.odd[2] ? u : 0); z <= box.high.z; z += 2 * u)
    for (std::int64_t y = box.low.y + (pass.odd[1] ? u : 0); y <= box.high.y; y += 2 * u) f(y, z);
}

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
    const std::int64_t u = pass.unit;
    set_every(2 * u, pass.odd[0] ? u : 0, mask_);
    if (pass.odd_count == 3) {
      set_every(4 * u, u, first_);
      set_every(4 * u, 3 * u, third_);
    }
    for_each_row(pass, active_.box(), [&](std::int64_t y, std::int64_t z) {
      if (pass.odd_count < 3)
        find_between(y, z);
      else if (2 * u < cube_size_)
        find_below_edge_midpoints(y, z);
      else
        add(y, z, [&](std::size_t i) { return mask_[i]; });
    });
  }

 private:
  // Sets `row` to the points at `start` and at every multiple of `period` from there.
  void set_every(std::int64_t period, std::int64_t start, std::vector<Word>& row) const {
    row.assign(active_.words_per_row(), 0);
    for (std::int64_t x = start; x < active_.box().size().x; x += period)
      row[static_cast<std::size_t>(x / 64)] |= Word{1} << (x % 64);
  }

  template <class WordOf>
  void add(std::int64_t y, std::int64_t z, WordOf word_of) {
    Word* row = bits_.row(y, z);
    for (std::size_t i = 0; i < mask_.size(); ++i) row[i] |= word_of(i);
  }

  // The activity of the points that are `step` from those of a word.
  Word active_at(std::int64_t y, std::int64_t z, std::size_t i, Index3 step) const {
    return NeighbourWord(active_, y, z, i, step).of(active_);
  }

  // Face centres and edge midpoints lie between their parents along each axis that is not odd.
  void find_between(std::int64_t y, std::int64_t z) {
    const std::int64_t u = pass_.unit;
    const Box& box = active_.box();
    const auto last = static_cast<std::size_t>(box.size().x - 1);
    add(y, z, [&](std::size_t i) {
      const auto at = [&](Index3 step) { return active_at(y, z, i, step); };
      // Parents outside the box do not count.
      Word all = mask_[i];
      if (!pass_.odd[1] && y > box.low.y) all &= at({0, -u, 0});
      if (!pass_.odd[1] && y < box.high.y) all &= at({0, u, 0});
      if (!pass_.odd[2] && z > box.low.z) all &= at({0, 0, -u});
      if (!pass_.odd[2] && z < box.high.z) all &= at({0, 0, u});
      if (all != 0 && !pass_.odd[0]) {
        const Word first_of_row = i == 0 ? 1 : 0, last_of_row = i == last / 64 ? Word{1} << (last % 64) : 0;
        all &= (at({-u, 0, 0}) | first_of_row) & (at({u, 0, 0}) | last_of_row);
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
    // The step to the shared corner; the opposite one leads across.
    const std::int64_t near_y = ((y - low.y) & (2 * u)) ? u : -u, near_z = ((z - low.z) & (2 * u)) ? u : -u;
    add(y, z, [&](std::size_t i) {
      const auto with_corner = [&](std::int64_t near_x) {
        return active_at(y, z, i, {-near_x, near_y, near_z}) & active_at(y, z, i, {near_x, -near_y, near_z}) &
               active_at(y, z, i, {near_x, near_y, -near_z});
      };
      return (with_corner(-u) & first_[i]) | (with_corner(u) & third_[i]);
    });
  }

  const LatticeBits& active_;
  int cube_size_;
  LatticeBits bits_;
  Pass pass_{};
  std::vector<Word> mask_;
  std::vector<Word> first_, third_;  ///< of cube centres: those at u, 5u, .., and at 3u, 7u, ..
};

}  // namespace tagrid
