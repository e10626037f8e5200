// Points whose activity is not what was forecast, of the passes that have been coded.
#pragma once

#include <cstdint>
#include <vector>

#include "stages/activity/candidates.h"
#include "stages/activity/forecast.h"
#include "stages/activity/neighbour_words.h"
#include "stages/grid/lattice_bits.h"

namespace tagrid {

/// There are few of them, so it pays to know which rows have one.
class Surprises {
 public:
  explicit Surprises(const Box& box)
      : box_(box),
        words_(static_cast<std::size_t>(box.size().y + 63) / 64 + 2),
        rows_(words_ * static_cast<std::size_t>(box.size().z)),
        more_(box),
        less_(box) {}

  /// Adds those of a pass. `mask`: the x coordinates of the pass.
  void add(const Pass& pass, const std::vector<Word>& mask, const LatticeBits& active,
           const LatticeBits& expected) {
    for_each_row(pass, box_, [&](std::int64_t y, std::int64_t z) {
      const Word *is_active = active.row(y, z), *is_expected = expected.row(y, z);
      Word *more = more_.row(y, z), *less = less_.row(y, z), any = 0;
      for (std::size_t i = 0; i < mask.size(); ++i) {
        const Word different = (is_active[i] ^ is_expected[i]) & mask[i];
        more[i] |= different & is_active[i];
        less[i] |= different & is_expected[i];
        any |= different;
      }
      const auto row = static_cast<std::size_t>(y - box_.low.y + 64);
      rows_[static_cast<std::size_t>(z - box_.low.z) * words_ + row / 64] |= Word{any != 0} << row % 64;
    });
  }

  /// Active, but not expected to be.
  const LatticeBits& more() const { return more_; }
  /// Expected to be active, but not.
  const LatticeBits& less() const { return less_; }

  /// Bit 32 + d says whether there are any in the row at y + d, z. REQUIRES: y is in the box.
  Word rows_around(std::int64_t y, std::int64_t z) const {
    if (z < box_.low.z || z > box_.high.z) return 0;
    // Rows are counted from the second word on, so that there are 32 before the first.
    const auto first = static_cast<std::size_t>(y - box_.low.y + 32);
    const Word* slice = rows_.data() + static_cast<std::size_t>(z - box_.low.z) * words_ + first / 64;
    return first % 64 == 0 ? slice[0] : slice[0] >> first % 64 | slice[1] << (64 - first % 64);
  }

  static constexpr std::uint64_t working_bytes(Index3 size) {
    return 2 * LatticeBits::working_bytes(size) +
           static_cast<std::uint64_t>(((size.y + 63) / 64 + 2) * size.z) * sizeof(Word);
  }

 private:
  Box box_;
  std::size_t words_;  ///< of a slice in rows_
  std::vector<Word> rows_;
  LatticeBits more_, less_;
};

}  // namespace tagrid
