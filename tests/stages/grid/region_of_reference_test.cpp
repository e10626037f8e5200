// The exact size of the bounded region of reference. The paper's 8 1/3 S^3 omits edge and corner neighbours.
#include "stages/grid/region_of_reference.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <string>

#include "stages/grid/lattice.h"

namespace tagrid {
namespace {

std::int64_t count(const LatticeBits& bits) {
  std::int64_t n = 0;
  for (std::uint64_t word : bits.words()) n += std::popcount(word);
  return n;
}

// The smallest box that holds all set bits.
Box extent(const LatticeBits& bits) {
  const Box& b = bits.box();
  Box result{b.high, b.low};
  for (std::int64_t z = b.low.z; z <= b.high.z; ++z)
    for (std::int64_t y = b.low.y; y <= b.high.y; ++y)
      for (std::int64_t x = b.low.x; x <= b.high.x; ++x)
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
  for (std::int64_t z = b.low.z; z <= b.high.z; ++z)
    for (std::int64_t y = b.low.y; y <= b.high.y; ++y)
      for (std::int64_t x = b.low.x; x <= b.high.x; ++x) {
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
