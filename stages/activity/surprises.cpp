#include "stages/activity/surprises.h"

namespace tagrid {

void Surprises::add(const Pass& pass, const std::vector<Word>& mask, const LatticeBits& active,
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

}  // namespace tagrid
