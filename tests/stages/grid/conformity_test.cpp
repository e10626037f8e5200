// Conforming grids, and the region that a point refers to.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <string>

#include "stages/grid/conformity.h"
#include "stages/grid/lattice.h"
#include "tests/support/points.h"

namespace tagrid {
namespace {

constexpr int cube_size = 8;
const Box domain{{0, 0, 0}, {16, 16, 8}};

LatticeBits with_root_corners() {
  LatticeBits bits(domain);
  for (const auto [x, y, z] : points_of(Box{{}, domain.high}, cube_size)) bits.set({x, y, z});
  return bits;
}

void activate_with_ancestors(LatticeBits& bits, Index3 p) {
  bits.set(p);
  for (Index3 parent : parents(p, classify(p, cube_size), cube_size))
    if (bits.box().contains(parent) && !bits.test(parent)) activate_with_ancestors(bits, parent);
}

void clear(LatticeBits& bits, Index3 p) { bits.row(p.y, p.z)[p.x / 64] &= ~(std::uint64_t{1} << (p.x % 64)); }

TEST(Conformity, RootCornersAloneConform) {
  EXPECT_TRUE(is_conforming(with_root_corners(), domain, cube_size));
}

TEST(Conformity, AMissingRootCornerIsNamed) {
  EXPECT_EQ(first_nonconforming_point(LatticeBits(domain), domain, cube_size), (Index3{0, 0, 0}));
  LatticeBits bits = with_root_corners();
  clear(bits, {8, 16, 8});
  EXPECT_EQ(first_nonconforming_point(bits, domain, cube_size), (Index3{8, 16, 8}));
}

TEST(Conformity, APointWithAllAncestorsConformsAndWithoutAnyOneDoesNot) {
  LatticeBits bits = with_root_corners();
  const LatticeBits empty = bits;
  activate_with_ancestors(bits, {7, 8, 3});
  EXPECT_TRUE(is_conforming(bits, domain, cube_size));
  int ancestors = 0;
  for (const auto [x, y, z] : points_of(Box{{}, domain.high})) {
    const Index3 p{x, y, z};
    if (!bits.test(p) || empty.test(p) || p == Index3{7, 8, 3}) continue;
    ++ancestors;
    LatticeBits broken = bits;
    clear(broken, p);
    EXPECT_FALSE(is_conforming(broken, domain, cube_size)) << x << ' ' << y << ' ' << z;
  }
  EXPECT_GT(ancestors, 8);
}

TEST(Conformity, TheOrphanIsNamed) {
  LatticeBits bits = with_root_corners();
  bits.set({4, 4, 4});  // a root centre has no parents
  EXPECT_TRUE(is_conforming(bits, domain, cube_size));
  bits.set({8, 4, 4});  // its parents are (4,4,4) and (12,4,4)
  EXPECT_EQ(first_nonconforming_point(bits, domain, cube_size), (Index3{8, 4, 4}));
}

TEST(Conformity, ParentsOutsideTheBoxOrTheDomainAskForNothing) {
  const Box left{{0, 0, 0}, {8, 8, 8}};
  LatticeBits bits(left);
  copy_bits(with_root_corners(), bits);
  bits.set({4, 4, 4});
  bits.set({8, 4, 4});
  EXPECT_TRUE(is_conforming(bits, domain, cube_size));
  EXPECT_TRUE(is_conforming(bits, left, cube_size));
  LatticeBits wide = with_root_corners();
  wide.set({4, 4, 4});
  wide.set({8, 4, 4});
  EXPECT_FALSE(is_conforming(wide, domain, cube_size));
  EXPECT_TRUE(is_conforming(wide, left, cube_size));
}

// The exact size of the bounded region of reference. The paper's 8 1/3 S^3 omits edge and corner neighbours.

std::int64_t count(const LatticeBits& bits) {
  std::int64_t n = 0;
  for (std::uint64_t word : bits.words()) n += std::popcount(word);
  return n;
}

// The smallest box that holds all set bits.
Box extent(const LatticeBits& bits) {
  const Box& b = bits.box();
  Box result{b.high, b.low};
  for (const auto [x, y, z] : points_of(b))
    if (bits.test({x, y, z}))
      for (int axis = 0; axis < 3; ++axis) {
        result.low[axis] = std::min(result.low[axis], Index3{x, y, z}[axis]);
        result.high[axis] = std::max(result.high[axis], Index3{x, y, z}[axis]);
      }
  return result;
}

struct Size {
  int cube_size, cubes;
  std::int64_t points;  ///< exact
  double volumes;       ///< points / S^3, rounded
};

class RegionOfReference : public testing::TestWithParam<Size> {};

TEST_P(RegionOfReference, HasTheExactSizeAndReachesSMinus2) {
  const auto [s, cubes, points, volumes] = GetParam();
  const Box box{{0, 0, 0}, std::int64_t{s} * cubes * Index3{1, 1, 1}};
  const LatticeBits region = region_of_reference(box, s);
  EXPECT_EQ(count(region), points);
  EXPECT_NEAR(static_cast<double>(count(region)) / (double(s) * s * s), volumes, 0.05);
  EXPECT_EQ(extent(region), box.grown(s - 2));
}

INSTANTIATE_TEST_SUITE_P(Sizes, RegionOfReference,
                         testing::Values(Size{8, 1, 7889, 15.4}, Size{16, 1, 81415, 19.9},
                                         Size{32, 1, 736981, 22.5}, Size{64, 1, 6266595, 23.9},
                                         Size{32, 2, 1872189, 57.1}),
                         [](const auto& test) {
                           std::string name = "S";
                           name += std::to_string(test.param.cube_size);
                           name += "Cubes";
                           return name += std::to_string(test.param.cubes);
                         });

TEST(RegionOfReferenceLaw, IsClosedUnderChildrenAndHoldsNothingElse) {
  const int s = 8;
  const Box box{{8, 16, 8}, {16, 24, 16}};
  const LatticeBits region = region_of_reference(box, s);
  const Box& b = region.box();
  for (const auto [x, y, z] : points_of(b)) {
    const Index3 p{x, y, z};
    const PointClass c = classify(p, s);
    if (c.odd == 0) continue;
    bool has_parent = false;
    for (Index3 parent : parents(p, c, s)) has_parent |= b.contains(parent) && region.test(parent);
    EXPECT_EQ(region.test(p), box.contains(p) || has_parent);
  }
}

}  // namespace
}  // namespace tagrid
