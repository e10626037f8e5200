#include "stages/grid/lattice_bits.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <random>
#include <vector>

#include "tests/support/conforming_activity.h"

namespace tagrid {
namespace {

Box random_box() {
  const auto coordinate = [] { return std::int64_t{*rc::gen::inRange(-5, 6)}; };
  const Index3 low{std::int64_t{*rc::gen::inRange(-140, 141)}, coordinate(), coordinate()};
  const Index3 size{*rc::gen::inRange(1, 200), *rc::gen::inRange(1, 8), *rc::gen::inRange(1, 8)};
  return {low, low + size - Index3{1, 1, 1}};
}

LatticeBits random_bits(const Box& box, std::uint64_t seed) {
  LatticeBits bits(box);
  std::mt19937_64 random(seed);
  for_each_point(box, [&](Index3 p) {
    if (random() & 1) bits.set(p);
  });
  return bits;
}

RC_GTEST_PROP(LatticeBits, EverySetPointIsVisitedOnceInRasterOrder, ()) {
  const Box box = random_box();
  LatticeBits bits = random_bits(box, 3);
  std::vector<std::int64_t> expected, visited;
  for_each_point(box, [&](Index3 p) {
    if (bits.test(p)) expected.push_back(box.offset(p));
  });
  for_each_set(bits, [&](Index3 p, std::size_t number) {
    RC_ASSERT(box.offset(p) == static_cast<std::int64_t>(number));
    visited.push_back(box.offset(p));
    bits.clear(p);
  });
  RC_ASSERT(visited == expected);
  RC_ASSERT(bits == LatticeBits(box));
}

RC_GTEST_PROP(LatticeBits, CopyTakesTheSharedPointsAndLeavesTheOthers, ()) {
  const LatticeBits from = random_bits(random_box(), 1);
  const LatticeBits before = random_bits(random_box(), 2);
  LatticeBits to = before;
  copy_bits(from, to);
  LatticeBits expected(to.box());
  for_each_point(to.box(), [&](Index3 p) {
    if (from.box().contains(p) ? from.test(p) : before.test(p)) expected.set(p);
  });
  RC_ASSERT(to == expected);  // compares the words, so bits past the end of rows must be zero
}

TEST(LatticeBits, EveryPointHasABitOfItsOwn) {
  const Box box{{-3, 2, 0}, {126, 4, 1}};
  for (Index3 only : {Index3{-3, 2, 0}, Index3{60, 2, 0}, Index3{61, 3, 1}, Index3{126, 4, 1}}) {
    LatticeBits bits(box);
    bits.set(only);
    for_each_point(box, [&](Index3 p) { EXPECT_EQ(bits.test(p), p == only); });
  }
}

TEST(LatticeBits, RowsStartWords) {
  LatticeBits bits(Box{{5, 0, 0}, {69, 1, 1}});
  EXPECT_EQ(bits.words_per_row(), 2u);
  EXPECT_EQ(bits.bytes(), 2u * 4 * 8);
  bits.set({69, 1, 1});
  EXPECT_EQ(bits.row(1, 1)[1], 1u);
  EXPECT_EQ(LatticeBits().bytes(), 0u);
}

}  // namespace
}  // namespace tagrid
