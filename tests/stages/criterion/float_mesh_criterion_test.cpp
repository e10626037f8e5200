// The mesh criterion on floats, against every sample of every leaf.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "stages/criterion/mesh_criterion.h"
#include "stages/criterion/subdivide.h"
#include "stages/mesh/tetrahedra.h"

namespace tagrid {
namespace {

template <class T>
struct FloatVolume {
  Domain domain;
  Box box;
  std::vector<T> values;

  FloatVolume(Index3 dims, int cube_size, unsigned seed, int not_finite_one_in) : domain{dims, cube_size} {
    std::mt19937 random(seed);
    const Box volume = domain.volume();
    std::vector<T> inside(static_cast<std::size_t>(volume.count()));
    T level = 10;
    for (auto& v : inside) {
      level += static_cast<T>(static_cast<int>(random() % 101) - 50) / 100;
      v = level;
      if (not_finite_one_in > 0 && random() % static_cast<unsigned>(not_finite_one_in) == 0)
        v = random() % 2 ? std::numeric_limits<T>::quiet_NaN() : -std::numeric_limits<T>::infinity();
    }
    box = domain.padded().grown(mesh_criterion_halo(cube_size));
    for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
      for (std::int64_t y = box.low.y; y <= box.high.y; ++y)
        for (std::int64_t x = box.low.x; x <= box.high.x; ++x)
          values.push_back(inside[static_cast<std::size_t>(volume.offset(volume.nearest({x, y, z})))]);
  }
  T at(Index3 p) const { return values[static_cast<std::size_t>(box.offset(p))]; }
  LatticeBits closed_marks(double bound) const {
    LatticeBits marks(domain.padded());
    mark_mesh_error(Samples<T>{box, values.data()}, domain, bound, marks);
    close_under_parents(marks, domain.cube_size);
    return marks;
  }
};

// True if a tetrahedron keeps the law: every sample in it except its vertices is finite and within the bound
// of the interpolation between finite vertices.
template <class T>
bool keeps_the_bound(const FloatVolume<T>& volume, const std::array<Index3, 4>& v, double bound) {
  const std::int64_t whole = six_volumes(v), sign = whole < 0 ? -1 : 1;
  Box around{v[0], v[0]};
  for (const Index3& p : v)
    for (int axis = 0; axis < 3; ++axis) {
      around.low[axis] = std::min(around.low[axis], p[axis]);
      around.high[axis] = std::max(around.high[axis], p[axis]);
    }
  around = intersection(around, volume.domain.volume());
  for (std::int64_t z = around.low.z; z <= around.high.z; ++z)
    for (std::int64_t y = around.low.y; y <= around.high.y; ++y)
      for (std::int64_t x = around.low.x; x <= around.high.x; ++x) {
        if (std::find(v.begin(), v.end(), Index3{x, y, z}) != v.end()) continue;
        long double sum = 0;
        bool inside = true;
        for (std::size_t i = 0; i < 4; ++i) {
          auto part = v;
          part[i] = {x, y, z};
          const std::int64_t weight = six_volumes(part) * sign;
          inside = inside && weight >= 0;
          sum += static_cast<long double>(weight) * static_cast<long double>(volume.at(v[i]));
        }
        const long double error = std::fabs(sum / static_cast<long double>(whole * sign) -
                                            static_cast<long double>(volume.at({x, y, z})));
        if (inside && !(error <= static_cast<long double>(bound))) return false;
      }
  return true;
}

template <class T>
class FloatMeshCriterion : public testing::Test {};
using Types = testing::Types<float, double>;
TYPED_TEST_SUITE(FloatMeshCriterion, Types);

const Index3 shapes[] = {{9, 9, 9}, {12, 6, 7}, {1, 9, 14}, {17, 1, 1}, {3, 2, 5}};

TYPED_TEST(FloatMeshCriterion, AfterTheClosureNoLeafViolatesTheBound) {
  for (const Index3 dims : shapes)
    for (const int cube : {4, 8})
      for (const int not_finite_one_in : {0, 40, 400})
        for (const double bound : {0.0, 0.01, 0.3, 1.5, 1e30}) {
          const FloatVolume<TypeParam> volume(dims, cube, 2, not_finite_one_in);
          const LatticeBits active = volume.closed_marks(bound);
          for_each_leaf_tetrahedron(active, active.box(), cube, 24, [&](const Tetrahedron& leaf) {
            ASSERT_TRUE(keeps_the_bound(volume, leaf.vertices, bound)) << bound << " " << not_finite_one_in;
          });
        }
}

TYPED_TEST(FloatMeshCriterion, ALooseBoundOnFiniteSamplesMarksNothing) {
  const FloatVolume<TypeParam> volume({12, 9, 10}, 8, 2, 0);
  EXPECT_EQ(volume.closed_marks(1e30), [&] {
    LatticeBits corners(volume.domain.padded());
    close_under_parents(corners, 8);
    return corners;
  }());
}

TYPED_TEST(FloatMeshCriterion, AConstantRegionMarksNothingAtABoundOfZero) {
  for (const TypeParam v : {TypeParam(0.1), TypeParam(-0.0), std::numeric_limits<TypeParam>::max(),
                            std::numeric_limits<TypeParam>::denorm_min()}) {
    FloatVolume<TypeParam> volume({12, 9, 10}, 4, 2, 0);
    LatticeBits corners(volume.domain.padded());
    close_under_parents(corners, 4);
    std::fill(volume.values.begin(), volume.values.end(), v);
    EXPECT_EQ(volume.closed_marks(0), corners) << v;
  }
}

// A mean of NaNs has no payload: they come back bit by bit at active points only.
TYPED_TEST(FloatMeshCriterion, EverySampleOfARegionThatIsNotFiniteIsMarked) {
  FloatVolume<TypeParam> volume({7, 9, 5}, 4, 2, 0);
  std::fill(volume.values.begin(), volume.values.end(), std::numeric_limits<TypeParam>::signaling_NaN());
  const LatticeBits active = volume.closed_marks(1e30);
  for (std::int64_t z = 0; z < 5; ++z)
    for (std::int64_t y = 0; y < 9; ++y)
      for (std::int64_t x = 0; x < 7; ++x) EXPECT_TRUE(active.test({x, y, z})) << x << " " << y << " " << z;
}

TYPED_TEST(FloatMeshCriterion, TileByTileIsTheWhole) {
  const FloatVolume<TypeParam> volume({30, 21, 18}, 8, 4, 300);
  const LatticeBits whole = volume.closed_marks(0.5);
  LatticeBits tiled(volume.domain.padded());
  for (std::int64_t z = 0; z <= tiled.box().high.z; z += 8)
    for (std::int64_t x = 0; x <= tiled.box().high.x; x += 16) {
      LatticeBits tile(intersection(Box{{x, 0, z}, {x + 15, tiled.box().high.y, z + 7}}, tiled.box()));
      mark_mesh_error(Samples<TypeParam>{volume.box, volume.values.data()}, volume.domain, 0.5, tile);
      copy_bits(tile, tiled);
    }
  close_under_parents(tiled, 8);
  EXPECT_EQ(whole, tiled);
}

}  // namespace
}  // namespace tagrid
