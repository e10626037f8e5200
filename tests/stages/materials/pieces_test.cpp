// Pieces of tetrahedra and pyramids, for all materials of their corners and all orders of their edges.
#include "stages/materials/pieces.h"

#include <gtest/gtest.h>

#include <numeric>
#include <vector>

namespace tagrid {
namespace {

TEST(MaterialPieces, OfTetrahedraAreAtMostEight) {
  std::array<std::uint8_t, 6> order{};
  std::iota(order.begin(), order.end(), std::uint8_t{0});
  do {
    Pieces pieces;
    for (const std::uint8_t e : order)
      pieces.bisect(edges_of_tetrahedron[e], static_cast<PieceVertex>(first_cut + e));
    EXPECT_LE(pieces.count, 8U);
  } while (std::next_permutation(order.begin(), order.end()));
}

// Five materials, or snapped (-1), at each corner of a pyramid.
TEST(MaterialPieces, OfPyramidsAreFewAndHaveOneMaterial) {
  for (int code = 0; code < 7776; ++code) {
    std::array<int, 5> labels{};
    for (int rest = code, i = 0; i < 5; ++i, rest /= 6) labels[static_cast<std::size_t>(i)] = rest % 6 - 1;
    const auto differ = [&](std::size_t a, std::size_t b) {
      return labels[a] >= 0 && labels[b] >= 0 && labels[a] != labels[b];
    };
    std::array<bool, 8> is_cut{};
    std::vector<std::uint8_t> cuts;
    for (std::uint8_t e = 0; e < 8; ++e) {
      is_cut[e] = differ(edges_of_pyramid[e][0], edges_of_pyramid[e][1]);
      if (is_cut[e]) cuts.push_back(e);
    }
    int beginnings = 0;
    std::size_t most = 0, mixed = 0;
    const auto to_apex = std::find_if(cuts.begin(), cuts.end(), [](std::uint8_t e) { return e >= 4; });
    do
      for_each_beginning<std::uint8_t>({differ(0, 2), differ(1, 3)}, is_cut, cuts, [&](Pieces pieces) {
        ++beginnings;
        for (const std::uint8_t e : cuts)
          pieces.bisect(edges_of_pyramid[e], static_cast<PieceVertex>(first_cut + e));
        most = std::max(most, pieces.count);
        for (const Piece& piece : pieces.all())
          for (const PieceVertex a : piece)
            for (const PieceVertex b : piece) mixed += a < first_cut && b < first_cut && differ(a, b);
      });
    while (std::next_permutation(to_apex, cuts.end()));
    ASSERT_GT(beginnings, 0) << code;
    ASSERT_LE(most, Pieces::most) << code;
    ASSERT_EQ(mixed, 0U) << code;
  }
}

}  // namespace
}  // namespace tagrid
