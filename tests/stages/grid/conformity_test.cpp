#include "stages/grid/conformity.h"

#include <gtest/gtest.h>

#include "stages/grid/lattice.h"

namespace tagrid {
namespace {

constexpr int cube_size = 8;
const Box domain{{0, 0, 0}, {16, 16, 8}};

LatticeBits with_root_corners() {
  LatticeBits bits(domain);
  for (std::int64_t z = 0; z <= domain.high.z; z += cube_size)
    for (std::int64_t y = 0; y <= domain.high.y; y += cube_size)
      for (std::int64_t x = 0; x <= domain.high.x; x += cube_size) bits.set({x, y, z});
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
  for (std::int64_t z = 0; z <= domain.high.z; ++z)
    for (std::int64_t y = 0; y <= domain.high.y; ++y)
      for (std::int64_t x = 0; x <= domain.high.x; ++x) {
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

}  // namespace
}  // namespace tagrid
