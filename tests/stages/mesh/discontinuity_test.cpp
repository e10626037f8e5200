// Claim 6 of the paper: steps and creases of the field are found and kept, wherever they lie relative to the
// root cubes. Claims 7 and 8: neither the size of the root cubes nor the direction of the axes matters.
#include <gtest/gtest.h>

#include "stages/grid/conformity.h"
#include "stages/mesh/tetrahedra.h"
#include "stages/phantom/phantom.h"
#include "tests/support/encode_volume.h"
#include "tests/support/points.h"

namespace tagrid {
namespace {

// Normals of the planes: the axes, diagonals of a face and of the cube, and one that fits no lattice.
struct Direction {
  std::array<double, 3> normal;
  const char* name;
  int largest_cube;  ///< the mirror images are left out for larger cubes, to save time
};
const Direction directions[] = {{{1, 0, 0}, "x", 16},         {{0, 1, 0}, "y", 8},
                                {{0, 0, 1}, "z", 8},          {{1, 1, 0}, "face", 16},
                                {{0, 1, -1}, "face'", 8},     {{1, 1, 1}, "diagonal", 16},
                                {{1, -1, 1}, "diagonal'", 8}, {{0.9, 0.38, 0.2}, "oblique", 16}};

// The plane with this direction through the point `at` of a diagonal of 3x3x3 root cubes; the diagonal does
// not lie in the plane.
class Plane {
 public:
  Plane(const Direction& direction, double at, int cube_size) : normal_(direction.normal) {
    const double length = std::hypot(normal_[0], normal_[1], normal_[2]);
    for (double& n : normal_) {
      n /= length;
      offset_ += n * (n < 0 ? 3 * cube_size - at : at);
    }
  }
  /// Distance along the normal.
  double distance(double x, double y, double z) const {
    return normal_[0] * x + normal_[1] * y + normal_[2] * z - offset_;
  }
  double distance(Index3 p) const {
    return distance(static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z));
  }

 private:
  std::array<double, 3> normal_;
  double offset_ = 0;
};

struct Field {
  oracle::Volume<std::int16_t> volume;
  LatticeBits active;
};

// Three root cubes along each axis; heights in voxels, 8 for the value range of 4096.
template <class F>
Field field_of(int cube_size, F height) {
  const std::int64_t n = 3 * std::int64_t{cube_size} + 1;
  Field field;
  field.volume = oracle::volume_of<std::int16_t>(
      {n, n, n}, [&](double x, double y, double z) { return 512 * height(x, y, z); });
  field.active = activity_of(field.volume, cube_size, {20, 8.0 / 4096, 24});
  return field;
}

// A step of four voxels between two samples.
Field step_at(const Plane& plane, int cube_size) {
  return field_of(cube_size,
                  [&](double x, double y, double z) { return plane.distance(x, y, z) > 0 ? 4.0 : 0.0; });
}

template <class Visit>
void for_each_leaf(const Field& field, int cube_size, Visit visit) {
  for_each_leaf_tetrahedron(field.active, field.active.box(), cube_size, 24, visit);
}

// Every leaf with samples of both sides among its vertices has been bisected at least down to half a cell of
// edge 2: no leaf hides more of the step than that.
TEST(Steps, CrossOnlyLeavesOfTheLastCycleWhereverTheyLie) {
  for (const int s : {8, 16})
    for (const Direction& direction : directions)
      for (int position = 0; position <= s && s <= direction.largest_cube; ++position) {
        const Plane plane(direction, s + position - 0.5, s);
        const Field field = step_at(plane, s);
        std::int64_t crossed = 0;
        for_each_leaf(field, s, [&](const Tetrahedron& leaf) {
          std::array<std::int16_t, 4> values;
          for (std::size_t i = 0; i < 4; ++i) values[i] = field.volume.at(leaf.vertices[i]);
          if (*std::min_element(values.begin(), values.end()) ==
              *std::max_element(values.begin(), values.end()))
            return;
          ++crossed;
          ASSERT_GE(leaf.level, max_level(s) - 2) << direction.name << " at " << position << " of " << s;
        });
        ASSERT_GT(crossed, 0) << direction.name;
        ASSERT_TRUE(is_conforming(field.active, field.active.box(), s));
      }
}

// A crease of 45 degrees, at and between the points of the lattice. Leaves that reach further than half a
// voxel on both sides of it lie in a cell of edge 2. If it is a plane of lattice points that fits the leaves,
// it is kept exactly, as faces of leaves: no leaf crosses it.
TEST(Creases, AreFacesOfLeavesOrCrossLeavesOfTheLastCycle) {
  for (const int s : {8, 16})
    for (const Direction& direction : directions)
      for (int half = 0; half <= 2 * s && s <= direction.largest_cube; ++half) {
        const Plane plane(direction, s + half / 2.0, s);
        const Field field =
            field_of(s, [&](double x, double y, double z) { return std::max(0.0, plane.distance(x, y, z)); });
        const int none = max_level(s) + 1;
        int coarsest = none, coarsest_halved = none;
        for_each_leaf(field, s, [&](const Tetrahedron& leaf) {
          double below = 0, above = 0;
          for (const Index3 v : leaf.vertices) {
            below = std::max(below, -plane.distance(v));
            above = std::max(above, plane.distance(v));
          }
          const double crosses_by = std::min(below, above);
          if (crosses_by > 1e-9) coarsest = std::min(coarsest, leaf.level);
          if (crosses_by > 0.5) coarsest_halved = std::min(coarsest_halved, leaf.level);
        });
        const std::string name = direction.name;
        const bool fits_leaves =
            half % 2 == 0 && (name == "x" || name == "y" || name == "z" || name == "face");
        const std::string where = name + " at " + std::to_string(half / 2.0) + " of " + std::to_string(s);
        ASSERT_GE(coarsest_halved, max_level(s) - 3) << where;
        ASSERT_TRUE(!fits_leaves || coarsest == none) << where;
      }
}

// Regions that are flat on both sides stay coarse: the finest marks are close to the step.
TEST(Steps, AreMarkedFinelyOnlyWithinThreeVoxels) {
  constexpr int s = 16;
  for (const Direction& direction : directions)
    for (const double at : {s + 0.5, s + 6.5, s + 15.5}) {
      const Plane plane(direction, at, s);
      const auto volume = oracle::volume_of<std::int16_t>(
          {3 * s + 1, 3 * s + 1, 3 * s + 1},
          [&](double x, double y, double z) { return plane.distance(x, y, z) > 0 ? 2048 : 0; });
      const LatticeBits marks = marks_of(volume, s, {20, 8.0 / 4096, 24});
      for (const auto [x, y, z] : points_of(Box{{}, {3 * s, 3 * s, 3 * s}})) {
        const bool fine = marks.test({x, y, z}) && classify({x, y, z}, s).unit == 1;
        ASSERT_FALSE(fine && std::abs(plane.distance({x, y, z})) > 3.5) << direction.name;
      }
    }
}

// A step that moves through a root cube changes the size of the grid, as more or less of the layer fits into
// coarse cubes, but not by much.
TEST(Steps, CostAboutTheSameWhereverTheyLie) {
  constexpr int s = 16;
  for (const Direction& direction : {directions[0], directions[1], directions[2]}) {
    std::int64_t least = std::numeric_limits<std::int64_t>::max(), most = 0;
    for (int position = 0; position <= s; ++position) {
      const std::int64_t count = count_of(step_at(Plane(direction, s + position - 0.5, s), s).active);
      least = std::min(least, count);
      most = std::max(most, count);
    }
    EXPECT_LT(static_cast<double>(most), 1.5 * static_cast<double>(least)) << direction.name;
  }
}

oracle::Volume<std::int16_t> phantom(Index3 dims) {
  oracle::Volume<std::int16_t> volume{
      dims, std::vector<std::int16_t>(static_cast<std::size_t>(Box::of_size(dims).count()))};
  const auto slice = static_cast<std::size_t>(dims.x * dims.y);
  for (std::int64_t z = 0; z < dims.z; ++z)
    phantom_slice<std::int16_t>(dims, 1, z,
                                {volume.samples.data() + slice * static_cast<std::size_t>(z), slice});
  return volume;
}

template <class T>
void expect_similar_counts_for_all_cube_sizes(const oracle::Volume<T>& volume, double field_scale,
                                              std::initializer_list<int> sizes, double tolerance) {
  double first = 0;
  for (const int s : sizes) {
    const auto count = static_cast<double>(count_of(activity_of(volume, s, {20, field_scale, 24})));
    testing::Test::RecordProperty("points_of_cube_size_" + std::to_string(s), static_cast<int>(count));
    if (first == 0) first = count;
    EXPECT_NEAR(count / first, 1, tolerance) << "S = " << s;
  }
}

TEST(RootCubes, OfAnySizeGiveAsManyActivePointsOfThePhantom) {
  expect_similar_counts_for_all_cube_sizes(phantom({129, 129, 65}), 8.0 / 4096, {8, 16, 32, 64}, 0.03);
}

TEST(RootCubes, OfAnySizeGiveAsManyActivePointsOfTheLobster) {
  const auto lobster = read_volume<std::uint8_t>("lobster_321x321x33.raw", {321, 321, 33});
  if (lobster.samples.empty()) GTEST_SKIP() << "lobster_321x321x33.raw is not beside the source tree";
  const double expected[] = {309.7, 307.5, 307.4, 309.9};
  int i = 0;
  for (const int s : {8, 16, 32, 64}) {
    const auto points = static_cast<double>(count_of(activity_of(lobster, s, {20, 8.0 / 252, 24})));
    EXPECT_NEAR(points / 1000, expected[i++], 0.06) << "S = " << s;
  }
}

// Claim 8. The axes in turn, and a quarter turn about z.
template <class T, class Image>
oracle::Volume<T> turned(const oracle::Volume<T>& volume, Index3 dims, Image original_of) {
  return oracle::volume_of<T>(dims, [&](double x, double y, double z) {
    return volume.at(original_of(
        Index3{static_cast<std::int64_t>(x), static_cast<std::int64_t>(y), static_cast<std::int64_t>(z)}));
  });
}

TEST(Turning, ByNinetyDegreesGivesAStatisticallyEqualGrid) {
  const auto volume = phantom({97, 97, 65});
  const Index3 d = volume.dims;
  const auto levels = [](const oracle::Volume<std::int16_t>& v) {
    const LatticeBits active = activity_of(v, 32, {20, 8.0 / 4096, 24});
    std::vector<double> count(16);
    for (const auto [x, y, z] : points_of(Box{{}, active.box().high}))
      if (active.test({x, y, z})) ++count[static_cast<std::size_t>(classify({x, y, z}, 32).level)];
    return count;
  };
  const std::vector<double> original = levels(volume);
  const std::vector<double> images[] = {levels(turned(volume, {d.z, d.x, d.y},
                                                      [](Index3 p) {
                                                        return Index3{p.y, p.z, p.x};
                                                      })),
                                        levels(turned(volume, {d.y, d.x, d.z},
                                                      [&](Index3 p) {
                                                        return Index3{d.x - 1 - p.y, p.x, p.z};
                                                      })),
                                        levels(turned(volume, {d.x, d.z, d.y}, [&](Index3 p) {
                                          return Index3{p.x, d.y - 1 - p.z, p.y};
                                        }))};
  for (const auto& image : images)
    for (std::size_t level = 1; level < original.size(); ++level)
      // Three percent, plus the random variation of the few points of a coarse level.
      EXPECT_NEAR(image[level], original[level], 0.03 * original[level] + 2 * std::sqrt(original[level]) + 2)
          << "level " << level;
}

}  // namespace
}  // namespace tagrid
