#include <bit>
#include <vector>

#include "stages/brick/codec.h"
#include "stages/grid/lattice.h"
#include "stages/sample/vector_code.h"

namespace tagrid {

TAGRID_VECTOR_CODE
void count_active(const LatticeBits& active, const CodingParameters& parameters, Index3 brick,
                  Statistics& statistics) {
  Box owned = active.box();
  for (int axis = 0; axis < 3; ++axis)
    if (brick[axis] > 0) ++owned.low[axis];
  const std::int64_t s = parameters.cube_size;
  // The x coordinates with exactly 2^i as their unit, and those with 2^i or more; the multiples of S are at
  // the end.
  const std::size_t words = active.words_per_row();
  struct Masks {
    std::vector<std::uint64_t> exactly, at_least;
  };
  std::vector<Masks> masks;
  for (std::int64_t unit = 1; unit <= s; unit *= 2) {
    Masks& m =
        masks.emplace_back(Masks{std::vector<std::uint64_t>(words), std::vector<std::uint64_t>(words)});
    for (std::int64_t x = owned.low.x; x <= owned.high.x; ++x) {
      const auto at = static_cast<std::size_t>(x - active.box().low.x);
      const std::uint64_t bit = std::uint64_t{x % unit == 0} << (at % 64);
      m.at_least[at / 64] |= bit;
      if (unit == s || x % (2 * unit) != 0) m.exactly[at / 64] |= bit;
    }
  }
  for (std::int64_t z = owned.low.z; z <= owned.high.z; ++z)
    for (std::int64_t y = owned.low.y; y <= owned.high.y; ++y) {
      const std::uint64_t* row = active.row(y, z);
      const auto count = [&](const std::vector<std::uint64_t>& mask, std::int64_t x) {
        std::uint64_t n = 0;
        for (std::size_t w = 0; w < words; ++w)
          n += static_cast<std::uint64_t>(std::popcount(row[w] & mask[w]));
        if (n > 0)
          statistics.active[static_cast<std::size_t>(classify({x, y, z}, parameters.cube_size).level)] += n;
      };
      // Points whose x has a larger unit than y or z have all the same level.
      const auto last = static_cast<std::size_t>(std::countr_zero(static_cast<std::uint64_t>(y | z | s)));
      for (std::size_t i = 0; i <= last; ++i) count(masks[i].exactly, std::int64_t{1} << i);
      if (last + 1 < masks.size()) count(masks[last + 1].at_least, s);
    }
}

}  // namespace tagrid
