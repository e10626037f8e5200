// The mesh criterion on integers and floats, against every sample of every leaf.
#include "stages/criterion/mesh_criterion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "stages/criterion/subdivide.h"
#include "stages/grid/lattice.h"
#include "stages/mesh/cut.h"
#include "stages/mesh/tetrahedra.h"
#include "tests/support/conforming_activity.h"
#include "tests/support/points.h"

namespace tagrid {
namespace {

// A volume, surrounded by the values of the nearest samples as far as the criterion reads.
template <class T>
struct Padded {
  Domain domain;
  Box box;
  std::vector<T> values;

  Padded(const Domain& of, const std::vector<T>& inside) : domain(of) {
    const Box volume = domain.volume();
    box = domain.padded().grown(mesh_criterion_halo(domain.cube_size));
    for (const auto [x, y, z] : points_of(box))
      values.push_back(inside[static_cast<std::size_t>(volume.offset(volume.nearest({x, y, z})))]);
  }
  Samples<T> samples() const { return {box, values.data()}; }
  T at(Index3 p) const { return values[static_cast<std::size_t>(box.offset(p))]; }
};

struct RoughVolume : Padded<std::uint8_t> {
  RoughVolume(Index3 dims, int cube_size, unsigned seed, int roughness)
      : RoughVolume(Domain{dims, cube_size}, seed, roughness) {}
  RoughVolume(const Domain& of, unsigned seed, int roughness)
      : Padded(of, values_of(of.dims, seed, roughness)) {}

  static std::vector<std::uint8_t> values_of(Index3 dims, unsigned seed, int roughness) {
    std::mt19937 random(seed);
    std::vector<std::uint8_t> inside(static_cast<std::size_t>(Box::of_size(dims).count()));
    int level = 100;
    for (auto& v : inside) {
      level = std::clamp(
          level + static_cast<int>(random() % static_cast<unsigned>(2 * roughness + 1)) - roughness, 0, 255);
      v = static_cast<std::uint8_t>(level);
    }
    return inside;
  }
};

template <class T>
struct FloatVolume : Padded<T> {
  FloatVolume(Index3 dims, int cube_size, unsigned seed, int not_finite_one_in, int lead = 0)
      : Padded<T>({dims, cube_size, lead}, values_of(dims, seed, not_finite_one_in)) {}

  static std::vector<T> values_of(Index3 dims, unsigned seed, int not_finite_one_in) {
    std::mt19937 random(seed);
    std::vector<T> inside(static_cast<std::size_t>(Box::of_size(dims).count()));
    T level = 10;
    for (auto& v : inside) {
      level += static_cast<T>(static_cast<int>(random() % 101) - 50) / 100;
      v = level;
      if (not_finite_one_in > 0 && random() % static_cast<unsigned>(not_finite_one_in) == 0)
        v = random() % 2 ? std::numeric_limits<T>::quiet_NaN() : -std::numeric_limits<T>::infinity();
    }
    return inside;
  }
  LatticeBits closed_marks(double bound) const {
    LatticeBits marks(this->domain.padded());
    mark_mesh_error(this->samples(), this->domain, bound, marks);
    close_under_parents(marks, this->domain.cube_size);
    return marks;
  }
};

// Calls use(p, weights, whole) for the samples of a volume in a tetrahedron. The weights of its vertices are
// volumes, and `whole` is their sum.
template <class Use>
void for_each_sample_in(const std::array<Index3, 4>& v, const Box& volume, Use use) {
  const std::int64_t whole = six_volumes(v), sign = whole < 0 ? -1 : 1;
  Box around{v[0], v[0]};
  for (const Index3& p : v)
    for (int axis = 0; axis < 3; ++axis) {
      around.low[axis] = std::min(around.low[axis], p[axis]);
      around.high[axis] = std::max(around.high[axis], p[axis]);
    }
  for (const Index3 p : points_of(intersection(around, volume))) {
    std::array<std::int64_t, 4> weights;
    for (std::size_t i = 0; i < 4; ++i) {
      auto part = v;
      part[i] = p;
      weights[i] = six_volumes(part) * sign;
    }
    if (*std::min_element(weights.begin(), weights.end()) >= 0) use(p, weights, whole * sign);
  }
}

// The largest |sample - interpolation| in a tetrahedron, as a fraction.
struct Fraction {
  std::int64_t numerator = 0, denominator = 1;
};
bool operator<(Fraction a, Fraction b) { return a.numerator * b.denominator < b.numerator * a.denominator; }

Fraction error_in(const RoughVolume& volume, const std::array<Index3, 4>& v) {
  Fraction worst;
  for_each_sample_in(v, volume.domain.volume(), [&](Index3 p, const auto& weights, std::int64_t whole) {
    std::int64_t sum = 0;
    for (std::size_t i = 0; i < 4; ++i) sum += weights[i] * volume.at(v[i]);
    worst = std::max(worst, Fraction{std::abs(sum - whole * volume.at(p)), whole});
  });
  return worst;
}

// True if a tetrahedron keeps the law: every sample in it except its vertices is finite and within the bound
// of the interpolation between finite vertices.
template <class T>
bool keeps_the_bound(const FloatVolume<T>& volume, const std::array<Index3, 4>& v, double bound) {
  bool kept = true;
  for_each_sample_in(v, volume.domain.volume(), [&](Index3 p, const auto& weights, std::int64_t whole) {
    if (std::find(v.begin(), v.end(), p) != v.end()) return;
    long double sum = 0;
    for (std::size_t i = 0; i < 4; ++i)
      sum += static_cast<long double>(weights[i]) * static_cast<long double>(volume.at(v[i]));
    const long double error =
        std::fabs(sum / static_cast<long double>(whole) - static_cast<long double>(volume.at(p)));
    kept = kept && error <= static_cast<long double>(bound);
  });
  return kept;
}

const Index3 shapes[] = {{9, 9, 9}, {12, 6, 7}, {1, 9, 14}, {17, 1, 1}, {3, 2, 5}};

TEST(DiamondError, IsThatOfTheTetrahedraOfTheDiamond) {
  for (const Index3 dims : shapes)
    for (const int cube : {4, 8}) {
      const RoughVolume volume({dims, cube, cube / 4 % 2}, 1, 30);
      for_each_point(volume.domain.padded(), [&](Index3 p) {
        const PointClass c = classify(p, cube);
        if (c.odd == 0) return;
        const Diamond d = diamond(p, c, cube);
        Fraction worst;
        for (int i = 0; i < d.size(); ++i)
          worst = std::max(worst, error_in(volume, d.tetrahedron(i).vertices));
        const std::int64_t found = diamond_error(volume.samples(), volume.domain, p, std::int64_t{1} << 40);
        ASSERT_EQ(found * worst.denominator, worst.numerator * 2 * c.unit) << p.x << ' ' << p.y << ' ' << p.z;
      });
    }
}

TEST(MarkMeshError, AfterTheClosureNoLeafViolatesTheBound) {
  for (const Index3 dims : shapes)
    for (const int cube : {4, 8})
      for (const int roughness : {2, 30})
        for (const std::int64_t bound : {0, 1, 4, 20}) {
          const RoughVolume volume({dims, cube, roughness == 2}, 2, roughness);
          LatticeBits marks(volume.domain.padded());
          mark_mesh_error(volume.samples(), volume.domain, bound, marks);
          close_under_parents(marks, cube);
          for_each_leaf_tetrahedron(marks, marks.box(), cube, 24, [&](const Tetrahedron& leaf) {
            const Fraction worst = error_in(volume, leaf.vertices);
            ASSERT_LE(worst.numerator, bound * worst.denominator);
          });
        }
}

TEST(MarkMeshError, LeavesThatTheBorderCutsKeepABoundOfTheirOwn) {
  int cut = 0;
  for (const Index3 dims : shapes)
    for (const int cube : {4, 8})
      for (const double border : {-1.0, 0.0, 1.5, 4.0, -2.0, 0.5}) {
        const RoughVolume volume({dims, cube, border == -2 || border > 1 || border == 0.5}, 2, 3);
        const Box all = volume.domain.volume();
        LatticeBits marks(volume.domain.padded());
        mark_mesh_error(volume.samples(), volume.domain, {6, border, 0}, marks);
        close_under_parents(marks, cube);
        for_each_leaf_tetrahedron(marks, marks.box(), cube, 24, [&](const Tetrahedron& leaf) {
          const Fraction worst = error_in(volume, leaf.vertices);
          const bool is_cut = cut_at(leaf.vertices, all).count > 0 && reaches_beyond(leaf.vertices, all);
          ASSERT_LE(static_cast<double>(worst.numerator),
                    (is_cut ? border : 6) * static_cast<double>(worst.denominator));
          ASSERT_FALSE(is_cut && border < 0);
          cut += is_cut;
        });
      }
  EXPECT_GT(cut, 100);
}

// Not more than necessary: the same closure as from marking exactly the points whose diamond violates the
// bound.
TEST(MarkMeshError, HasTheClosureOfTheViolatingPoints) {
  for (const Index3 dims : shapes)
    for (const int cube : {4, 8})
      for (const std::int64_t bound : {0, 3, 10}) {
        const RoughVolume volume({dims, cube, bound > 0}, 3, 8);
        LatticeBits marks(volume.domain.padded()), expected(volume.domain.padded());
        mark_mesh_error(volume.samples(), volume.domain, bound, marks);
        for_each_point(volume.domain.padded(), [&](Index3 p) {
          const PointClass c = classify(p, cube);
          if (c.odd > 0 &&
              diamond_error(volume.samples(), volume.domain, p, std::int64_t{1} << 40) > 2 * c.unit * bound)
            expected.set(p);
        });
        close_under_parents(marks, cube);
        close_under_parents(expected, cube);
        EXPECT_EQ(marks, expected);
      }
}

template <class Volume, class Bound>
void expect_tile_by_tile_the_whole(const Volume& volume, Bound bound) {
  LatticeBits whole(volume.domain.padded()), tiled(volume.domain.padded());
  mark_mesh_error(volume.samples(), volume.domain, bound, whole);
  for (std::int64_t z = 0; z <= tiled.box().high.z; z += 8)
    for (std::int64_t x = 0; x <= tiled.box().high.x; x += 16) {
      LatticeBits tile(intersection(Box{{x, 0, z}, {x + 15, tiled.box().high.y, z + 7}}, tiled.box()));
      mark_mesh_error(volume.samples(), volume.domain, bound, tile);
      copy_bits(tile, tiled);
    }
  close_under_parents(whole, 8);
  close_under_parents(tiled, 8);
  EXPECT_EQ(whole, tiled);
}

TEST(MarkMeshError, TileByTileIsTheWhole) {
  expect_tile_by_tile_the_whole(RoughVolume({30, 21, 18}, 8, 4, 6), std::int64_t{5});
}

template <class T>
class FloatMeshCriterion : public testing::Test {};
using Types = testing::Types<float, double>;
TYPED_TEST_SUITE(FloatMeshCriterion, Types);

TYPED_TEST(FloatMeshCriterion, AfterTheClosureNoLeafViolatesTheBound) {
  for (const Index3 dims : shapes)
    for (const int cube : {4, 8})
      for (const int not_finite_one_in : {0, 40, 400})
        for (const double bound : {0.0, 0.01, 0.3, 1.5, 1e30}) {
          const FloatVolume<TypeParam> volume(dims, cube, 2, not_finite_one_in, bound > 0.1);
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
  for (const auto [x, y, z] : points_of(Index3{7, 9, 5}))
    EXPECT_TRUE(active.test({x, y, z})) << x << " " << y << " " << z;
}

TYPED_TEST(FloatMeshCriterion, TileByTileIsTheWhole) {
  expect_tile_by_tile_the_whole(FloatVolume<TypeParam>({30, 21, 18}, 8, 4, 300), 0.5);
}

}  // namespace
}  // namespace tagrid
