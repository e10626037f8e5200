#include "stages/coarsen/coarsen.h"

#include <limits>

#include "stages/criterion/mesh_criterion.h"
#include "stages/criterion/subdivide.h"
#include "stages/grid/lattice.h"
#include "tests/support/coarsest_grid.h"
#include "tests/support/conforming_activity.h"
#include "tests/support/sanitized.h"

namespace tagrid {
namespace {

/// Ramps, steps and noise: leaves of every level, and many errors that are equal to a bound.
template <class T>
oracle::Volume<T> coarsening_volume(Index3 dims, unsigned seed, int lead = 0) {
  std::mt19937 random(seed);
  const double slope = random() % 4, noise = random() % 3, step = random() % 2 ? 60 : 0;
  auto volume = oracle::volume_of<T>(dims, [&](double x, double y, double z) {
    const double wave = 12 * std::sin(0.4 * x + 0.1 * static_cast<double>(seed)) * std::cos(0.3 * y);
    const double part = static_cast<double>(random() % 1001) / 1000;
    return std::clamp(30 + slope * (x + z) / 4 + wave / 2 + (x + 2 * y > z + 9 ? step : 0) + noise * part,
                      0.0, 126.0);
  });
  volume.lead = lead;
  return volume;
}

/// The grid of a volume as one brick.
template <class T>
LatticeBits coarsened(const oracle::Volume<T>& volume, int cube_size, double bound, bool padded,
                      LatticeBits active = {}, LatticeBits expanded = {}) {
  const Box box = volume.domain(cube_size).padded();
  if (active.box().empty()) active = LatticeBits(box);
  const std::vector<T> samples = volume.cut(box);
  refine_to_bound(sample_type_of<T>(), std::as_bytes(std::span(samples)),
                  {volume.box(), cube_size, bound, padded}, std::move(expanded), active);
  return active;
}

bool contains(const LatticeBits& all, const LatticeBits& some) {
  for (std::size_t i = 0; i < all.words().size(); ++i)
    if (some.words()[i] & ~all.words()[i]) return false;
  return true;
}

std::int64_t size_of(const LatticeBits& bits) {
  std::int64_t count = 0;
  for (const std::uint64_t word : bits.words()) count += std::popcount(word);
  return count;
}

constexpr double coarsening_bounds[] = {0, 0.5, 1, 2.75, 6, 20, 1000};

template <class T>
class Coarsen : public testing::Test {};
#ifdef TAGRID_SANITIZED
using IntegerTypes = testing::Types<std::int16_t, std::uint32_t>;
#else
using IntegerTypes =
    testing::Types<std::uint8_t, std::int8_t, std::uint16_t, std::int16_t, std::uint32_t, std::int32_t>;
#endif
TYPED_TEST_SUITE(Coarsen, IntegerTypes);

TYPED_TEST(Coarsen, IsTheLeastFixedPointThatAnOracleFinds) {
  unsigned seed = sizeof(TypeParam) + std::is_signed_v<TypeParam>;
  for (const Index3 dims :
       {Index3{9, 9, 9}, {5, 5, 5}, {2, 7, 11}, {12, 6, 10}, {1, 1, 1}, {14, 1, 3}, {10, 13, 9}})
    for (const double bound : coarsening_bounds) {
      const int cube_size = ++seed % 3 ? 8 : 4;
      const bool padded = seed % 2;
      const auto volume = coarsening_volume<TypeParam>(dims, seed, seed / 2 % 2);
      const LatticeBits expected = oracle::coarsest_grid(volume, cube_size, bound, padded);
      ASSERT_EQ(coarsened(volume, cube_size, bound, padded), expected)
          << dims.x << "x" << dims.y << "x" << dims.z << ", S " << cube_size << ", E " << bound << ", "
          << padded;
    }
}

// Values at the ends of the type: sums and differences must have room.
TYPED_TEST(Coarsen, HoldsForTheLargestDifferences) {
  using Limits = std::numeric_limits<TypeParam>;
  const double range = double{Limits::max()} - double{Limits::min()};
  std::mt19937 random(7);
  for (const bool padded : {false, true}) {
    oracle::Volume<TypeParam> volume{{13, 10, 15}, {}, padded ? 0 : 1};
    for (int i = 0; i < 13 * 10 * 15; ++i)
      volume.samples.push_back(random() % 5 ? Limits::max() : Limits::min());
    for (const double bound : {0.0, range / 4, range / 2, range - 1, range, 1e300})
      ASSERT_EQ(coarsened(volume, 16, bound, padded),
                oracle::coarsest_grid(volume, 16, std::min(bound, range), padded))
          << bound;
  }
}

class CoarsestGrid : public testing::Test {
 protected:
  static constexpr int cube_size = 8;
  const oracle::Volume<std::int16_t> volume = coarsening_volume<std::int16_t>({11, 9, 14}, 5, 1);
};

// In a closed set, a point without active children can be removed alone.
TEST_F(CoarsestGrid, NoPointCanBeRemoved) {
  for (const bool padded : {false, true}) {
    const LatticeBits grid = coarsened(volume, cube_size, 3.0, padded);
    ASSERT_FALSE(oracle::any_leaf_violates(volume, grid, cube_size, 3.0, padded));
    std::int64_t tried = 0;
    for_each_point(grid.box(), [&](Index3 p) {
      const PointClass c = classify(p, cube_size);
      if (c.odd == 0 || !grid.test(p)) return;
      for (const Index3 child : children(p, c))
        if (grid.box().contains(child) && grid.test(child)) return;
      LatticeBits without(grid.box());
      for_each_point(grid.box(), [&](Index3 q) {
        if (grid.test(q) && !(q == p)) without.set(q);
      });
      ++tried;
      ASSERT_TRUE(oracle::any_leaf_violates(volume, without, cube_size, 3.0, padded));
    });
    EXPECT_GT(tried, 20);
  }
}

TEST_F(CoarsestGrid, IsPartOfEveryGridWithinTheBound) {
  const LatticeBits grid = coarsened(volume, cube_size, 3.0, false);
  for (unsigned seed = 0; seed < 4; ++seed) {
    const LatticeBits other = oracle::coarsest_grid(
        volume, cube_size, 3.0, false, random_conforming_activity(grid.box(), cube_size, 6, seed));
    EXPECT_NE(other, grid);
    EXPECT_TRUE(contains(other, grid));
  }
}

// The closure of all points whose diamonds violate the bound: a point below a leaf that does not violate it counts, too.
TEST_F(CoarsestGrid, IsPartOfTheSaturatedGridAndMayBeSmaller) {
  const auto volume_with_noise = coarsening_volume<std::int16_t>({14, 11, 17}, 5);
  const Domain domain{volume_with_noise.dims, cube_size};
  const Box box = domain.padded(), around = box.grown(mesh_criterion_halo(cube_size));
  const std::vector<std::int16_t> samples = volume_with_noise.cut(around);
  std::int64_t smaller = 0;
  for (const double bound : coarsening_bounds) {
    LatticeBits saturated(box);
    mark_mesh_error(Samples<std::int16_t>{around, samples.data()}, domain, bound, saturated);
    close_under_parents(saturated, cube_size);
    const LatticeBits grid = coarsened(volume_with_noise, cube_size, bound, true);
    EXPECT_TRUE(contains(saturated, grid)) << bound;
    smaller += size_of(grid) < size_of(saturated);
  }
  EXPECT_GT(smaller, 0);
}

TEST_F(CoarsestGrid, ShrinksAsTheBoundGrows) {
  LatticeBits larger = coarsened(volume, cube_size, 0, false);
  for (const double bound : coarsening_bounds) {
    const LatticeBits grid = coarsened(volume, cube_size, bound, false);
    EXPECT_TRUE(contains(larger, grid)) << bound;
    larger = grid;
  }
  LatticeBits roots(larger.box());
  close_naively(roots, cube_size);
  EXPECT_EQ(larger, roots) << "above all differences, nothing but the root tetrahedra is left";
}

// What neighbours add is continued as if it had been there from the beginning.
TEST_F(CoarsestGrid, PointsMayBeAddedLater) {
  const LatticeBits before = coarsened(volume, cube_size, 3.0, false);
  for (unsigned seed = 0; seed < 4; ++seed) {
    LatticeBits more = before;
    std::mt19937 random(seed);
    const auto below = [&](std::int64_t n) { return static_cast<std::int64_t>(random()) % n; };
    const Index3 size = before.box().size();
    for (int i = 0; i < 5; ++i) more.set({below(size.x), below(size.y), below(size.z)});
    EXPECT_EQ(coarsened(volume, cube_size, 3.0, false, more, before),
              oracle::coarsest_grid(volume, cube_size, 3.0, false, more));
  }
}

// Small whole numbers have the same errors in every type. No error is as near to this bound as floats are rounded.
TEST_F(CoarsestGrid, FloatsHaveTheGridOfEqualIntegers) {
  const auto in = [&](auto type) {
    using T = decltype(type);
    return coarsened(
        oracle::Volume<T>{volume.dims, {volume.samples.begin(), volume.samples.end()}, volume.lead},
        cube_size, 2.3, true);
  };
  const LatticeBits grid = in(std::int16_t{});
  EXPECT_GT(size_of(grid), 300);
  EXPECT_EQ(in(float{}), grid);
  EXPECT_EQ(in(double{}), grid);
}

template <class T>
class CoarsenFloats : public testing::Test {};
using FloatTypes = testing::Types<float, double>;
TYPED_TEST_SUITE(CoarsenFloats, FloatTypes);

TYPED_TEST(CoarsenFloats, AreExactAroundSamplesThatAreNotFinite) {
  using T = TypeParam;
  const Index3 dims{9, 9, 9}, p{3, 5, 4};
  for (const T odd : {std::numeric_limits<T>::quiet_NaN(), std::numeric_limits<T>::infinity()}) {
    oracle::Volume<T> volume{dims, std::vector<T>(9 * 9 * 9, T{1})};
    volume.samples[static_cast<std::size_t>(Box::of_size(dims).offset(p))] = odd;
    const LatticeBits grid = coarsened(volume, 8, 1e30, false);
    EXPECT_TRUE(grid.test(p));
    for_each_leaf_tetrahedron(grid, grid.box(), 8, 9, [&](const Tetrahedron& t) {
      if (std::find(t.vertices.begin(), t.vertices.end(), p) == t.vertices.end()) return;
      std::int64_t others = 0;
      for_each_point(grid.box(), [&](Index3 q) {
        const auto weights = oracle::weights_of(t.vertices, q);
        others += *std::min_element(weights.begin(), weights.end()) >= 0 &&
                  std::find(t.vertices.begin(), t.vertices.end(), q) == t.vertices.end();
      });
      EXPECT_EQ(others, 0) << "a sample has no value of its own";
    });
  }
}

TYPED_TEST(CoarsenFloats, ConstantsNeedNoPointsEvenWithoutAnyError) {
  using T = TypeParam;
  for (const T value : {T{0.1F}, std::numeric_limits<T>::denorm_min(), std::numeric_limits<T>::max() / 64}) {
    const oracle::Volume<T> volume{{14, 11, 17}, std::vector<T>(14 * 11 * 17, value)};
    EXPECT_EQ(size_of(coarsened(volume, 8, 0, false)), 27) << value;
  }
}

}  // namespace
}  // namespace tagrid
