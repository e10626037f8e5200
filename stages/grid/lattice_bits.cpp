#include "stages/grid/lattice_bits.h"

#include <algorithm>
#include <bit>

namespace tagrid {
namespace {

// How one word of a row gets bits from another row: from one of its words, or from the upper bits of one word
// and the lower bits of the next.
struct Piece {
  std::size_t from, to;
  unsigned down, up;
  bool from_next;
  std::uint64_t mask;  ///< the bits of the target
};

std::vector<Piece> pieces(std::size_t from_bit, std::size_t to_bit, std::size_t n) {
  std::vector<Piece> result;
  for (std::size_t done = 0; done < n;) {
    const std::size_t t = to_bit + done, s = from_bit + done;
    const std::size_t count = std::min(n - done, 64 - t % 64);
    const std::uint64_t bits = count == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << count) - 1;
    result.push_back({s / 64, t / 64, static_cast<unsigned>(s % 64), static_cast<unsigned>(t % 64),
                      s % 64 + count > 64, bits << (t % 64)});
    done += count;
  }
  return result;
}

}  // namespace

std::uint64_t working_bytes_of_copying_bits(std::int64_t points) {
  // The pieces are stored in a vector whose capacity doubles.
  const auto pieces = static_cast<std::uint64_t>(points) / 64 + 2;
  return 3 * std::bit_ceil(pieces) * sizeof(Piece);
}

void copy_bits(const LatticeBits& from, LatticeBits& to) {
  const Box shared = intersection(from.box(), to.box());
  if (shared.empty()) return;
  // The pieces are the same for all rows.
  const auto row = pieces(static_cast<std::size_t>(shared.low.x - from.box().low.x),
                          static_cast<std::size_t>(shared.low.x - to.box().low.x),
                          static_cast<std::size_t>(shared.size().x));
  for (std::int64_t z = shared.low.z; z <= shared.high.z; ++z)
    for (std::int64_t y = shared.low.y; y <= shared.high.y; ++y) {
      const std::uint64_t* source = from.row(y, z);
      std::uint64_t* target = to.row(y, z);
      for (const Piece& piece : row) {
        std::uint64_t bits = source[piece.from] >> piece.down;
        if (piece.from_next) bits |= source[piece.from + 1] << (64 - piece.down);
        target[piece.to] = (target[piece.to] & ~piece.mask) | ((bits << piece.up) & piece.mask);
      }
    }
}

}  // namespace tagrid
