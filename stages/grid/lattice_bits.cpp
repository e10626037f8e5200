#include "grid/lattice_bits.h"

namespace tagrid {

void copy_bits(const LatticeBits& from, LatticeBits& to) {
  const Box shared = intersection(from.box(), to.box());
  if (shared.empty()) return;
  const auto n = static_cast<std::size_t>(shared.size().x);
  const auto from_bit = static_cast<std::size_t>(shared.low.x - from.box().low.x);
  const auto to_bit = static_cast<std::size_t>(shared.low.x - to.box().low.x);
  for (std::int64_t z = shared.low.z; z <= shared.high.z; ++z)
    for (std::int64_t y = shared.low.y; y <= shared.high.y; ++y) {
      const std::uint64_t* source = from.row(y, z);
      std::uint64_t* target = to.row(y, z);
      // One word of the target at a time, put together from up to two words of the source.
      for (std::size_t done = 0; done < n;) {
        const std::size_t t = to_bit + done, s = from_bit + done;
        const std::size_t count = std::min(n - done, 64 - t % 64);
        std::uint64_t bits = source[s / 64] >> (s % 64);
        if (s % 64 + count > 64) bits |= source[s / 64 + 1] << (64 - s % 64);
        const std::uint64_t mask = (count == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << count) - 1)
                                   << (t % 64);
        target[t / 64] = (target[t / 64] & ~mask) | ((bits << (t % 64)) & mask);
        done += count;
      }
    }
}

}  // namespace tagrid
