#include "stages/criterion/mesh_criterion.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <random>
#include <vector>

#include "stages/criterion/subdivide.h"
#include "stages/grid/diamond.h"
#include "stages/mesh/cut.h"
#include "stages/mesh/tetrahedra.h"

namespace tagrid {
namespace {

// A volume, surrounded by the values of the nearest samples as far as the criterion reads.
struct Padded {
  Domain domain;
  Box box;
  std::vector<std::uint8_t> values;

  Padded(Index3 dims, int cube_size, unsigned seed, int roughness) : domain{dims, cube_size} {
    std::mt19937 random(seed);
    const Box volume = domain.volume();
    std::vector<std::uint8_t> inside(static_cast<std::size_t>(volume.count()));
    int level = 100;
    for (auto& v : inside) {
      level = std::clamp(
          level + static_cast<int>(random() % static_cast<unsigned>(2 * roughness + 1)) - roughness, 0, 255);
      v = static_cast<std::uint8_t>(level);
    }
    box = domain.padded().grown(mesh_criterion_halo(cube_size));
    for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
      for (std::int64_t y = box.low.y; y <= box.high.y; ++y)
        for (std::int64_t x = box.low.x; x <= box.high.x; ++x)
          values.push_back(inside[static_cast<std::size_t>(volume.offset(volume.nearest({x, y, z})))]);
  }
  Samples<std::uint8_t> samples() const { return {box, values.data()}; }
  std::int64_t at(Index3 p) const { return values[static_cast<std::size_t>(box.offset(p))]; }
};

// The largest |sample - interpolation| in a tetrahedron, as a fraction: barycentric weights from volumes.
struct Fraction {
  std::int64_t numerator = 0, denominator = 1;
};
bool operator<(Fraction a, Fraction b) { return a.numerator * b.denominator < b.numerator * a.denominator; }

Fraction error_in(const Padded& volume, const std::array<Index3, 4>& v) {
  const std::int64_t whole = six_volumes(v), sign = whole < 0 ? -1 : 1;
  Box around{v[0], v[0]};
  for (const Index3& p : v)
    for (int axis = 0; axis < 3; ++axis) {
      around.low[axis] = std::min(around.low[axis], p[axis]);
      around.high[axis] = std::max(around.high[axis], p[axis]);
    }
  around = intersection(around, volume.domain.volume());
  Fraction worst;
  for (std::int64_t z = around.low.z; z <= around.high.z; ++z)
    for (std::int64_t y = around.low.y; y <= around.high.y; ++y)
      for (std::int64_t x = around.low.x; x <= around.high.x; ++x) {
        std::int64_t sum = 0;
        bool inside = true;
        for (std::size_t i = 0; i < 4; ++i) {
          auto part = v;
          part[i] = {x, y, z};
          const std::int64_t weight = six_volumes(part) * sign;
          inside = inside && weight >= 0;
          sum += weight * volume.at(v[i]);
        }
        if (!inside) continue;
        worst = std::max(worst, Fraction{std::abs(sum - whole * sign * volume.at({x, y, z})), whole * sign});
      }
  return worst;
}

template <class F>
void for_each_point(const Box& box, F f) {
  for (std::int64_t z = box.low.z; z <= box.high.z; ++z)
    for (std::int64_t y = box.low.y; y <= box.high.y; ++y)
      for (std::int64_t x = box.low.x; x <= box.high.x; ++x) f(Index3{x, y, z});
}

const Index3 shapes[] = {{9, 9, 9}, {12, 6, 7}, {1, 9, 14}, {17, 1, 1}, {3, 2, 5}};

TEST(DiamondError, IsThatOfTheTetrahedraOfTheDiamond) {
  for (const Index3 dims : shapes)
    for (const int cube : {4, 8}) {
      const Padded volume(dims, cube, 1, 30);
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
          const Padded volume(dims, cube, 2, roughness);
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
      for (const double border : {-1.0, 0.0, 1.5, 4.0}) {
        const Padded volume(dims, cube, 2, 3);
        const Index3 last = volume.domain.volume().high;
        LatticeBits marks(volume.domain.padded());
        mark_mesh_error(volume.samples(), volume.domain, {6, border, 0}, marks);
        close_under_parents(marks, cube);
        for_each_leaf_tetrahedron(marks, marks.box(), cube, 24, [&](const Tetrahedron& leaf) {
          const Fraction worst = error_in(volume, leaf.vertices);
          const bool is_cut = cut_at(leaf.vertices, last).count > 0 && reaches_beyond(leaf.vertices, last);
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
        const Padded volume(dims, cube, 3, 8);
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

TEST(MarkMeshError, TileByTileIsTheWhole) {
  const Padded volume({30, 21, 18}, 8, 4, 6);
  LatticeBits whole(volume.domain.padded()), tiled(volume.domain.padded());
  mark_mesh_error(volume.samples(), volume.domain, 5, whole);
  for (std::int64_t z = 0; z <= tiled.box().high.z; z += 8)
    for (std::int64_t x = 0; x <= tiled.box().high.x; x += 16) {
      LatticeBits tile(intersection(Box{{x, 0, z}, {x + 15, tiled.box().high.y, z + 7}}, tiled.box()));
      mark_mesh_error(volume.samples(), volume.domain, 5, tile);
      copy_bits(tile, tiled);
    }
  close_under_parents(whole, 8);
  close_under_parents(tiled, 8);
  EXPECT_EQ(whole, tiled);
}

}  // namespace
}  // namespace tagrid
