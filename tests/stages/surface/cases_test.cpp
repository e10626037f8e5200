// Tables of the cases of a surface, and its bytes.
#include <gtest/gtest.h>

#include <random>
#include <set>

#include "stages/grid/lattice.h"
#include "stages/surface/cases.h"
#include "stages/surface/surface.h"
#include "tests/support/counted_heap.h"
#include "tests/support/points.h"
#include "tests/support/sanitized.h"

namespace tagrid {
namespace {

using Corner = std::pair<unsigned, unsigned>;

Corner corner(CutEdge edge) { return std::minmax<unsigned>(edge.a, edge.b); }

// Six times the volume under a triangle, whose corners are in the middle of edges, times eight.
std::int64_t volume_under(const std::array<CutEdge, 3>& triangle) {
  constexpr std::array<Index3, 4> v = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  std::array<Index3, 4> corners;
  for (std::size_t i = 0; i < 3; ++i) corners[i] = v[triangle[i].a] + v[triangle[i].b];
  return -six_volumes({corners[0], corners[1], corners[2], Index3{0, 0, 0}});
}

TEST(SurfaceCases, CutsAndFacesTogetherBoundThePartThatIsInside) {
  for (unsigned inside = 1; inside < 16; ++inside) {
    std::set<std::pair<Corner, Corner>> directed;
    std::int64_t volume = 0;
    const auto add = [&](const std::array<CutEdge, 3>& triangle) {
      for (std::size_t i = 0; i < 3; ++i)
        EXPECT_TRUE(directed.emplace(corner(triangle[i]), corner(triangle[(i + 1) % 3])).second) << inside;
      volume += volume_under(triangle);
    };
    for (const auto& triangle : triangles_in_tetrahedron[inside]) {
      for (const CutEdge edge : triangle) EXPECT_NE((inside >> edge.a) & 1, (inside >> edge.b) & 1) << inside;
      add(triangle);
    }
    for (const auto& face : faces_of_tetrahedron) {
      unsigned of_face = 0;
      for (unsigned i = 0; i < 3; ++i) of_face |= ((inside >> face[i]) & 1) << i;
      for (std::array<CutEdge, 3> triangle : triangles_in_face[of_face]) {
        for (CutEdge& edge : triangle) edge = {face[edge.a], face[edge.b]};
        add(triangle);
      }
    }
    for (const auto& [a, b] : directed) EXPECT_TRUE(directed.contains({b, a})) << inside;
    // A corner cut at the middle of its edges has an eighth of the tetrahedron, a half is left between two edges.
    const int expected[] = {0, 1, 4, 7, 8};
    EXPECT_EQ(volume, expected[std::popcount(inside)]) << inside;
  }
}

TEST(SurfaceCases, ATetrahedronThatIsNotCrossedHasNoTriangle) {
  EXPECT_EQ(triangles_in_tetrahedron[0].count, 0U);
  EXPECT_EQ(triangles_in_tetrahedron[15].count, 0U);
}

// A surface takes no more memory than it states, and what it states is not much more than noise takes.

template <class T>
void check(int cube, Index3 cubes, Index3 cut) {
  const Box box{{0, 0, 0}, {cubes.x * cube, cubes.y * cube, cubes.z * cube}};
  LatticeBits active(box);
  std::vector<T> points(static_cast<std::size_t>(box.count()));
  std::mt19937_64 random(1);
  for (const auto [x, y, z] : points_of(Box{{}, box.high})) {
    active.set(Index3{x, y, z});
    // Edges along the axes, of which there are three at a point, always change sides; others, often.
    const bool odd = (x + y + z) % 2 != 0 || random() % 8 == 0;
    points[static_cast<std::size_t>(box.offset({x, y, z}))] = static_cast<T>(odd ? 100 : 0);
  }
  for (const bool close : {false, true}) {
    const SurfaceGrid grid{cube, {box.low, box.high - cut}, std::nullopt, close};
    const HeapPeak peak;
    const BrickSurface surface = surface_of_brick<T>(points, active, grid, {50});
    const std::uint64_t stated = working_bytes_of_surface(sample_type_of<T>(), box.size(), cube);
    EXPECT_LE(peak.bytes(), stated) << name_of(sample_type_of<T>()) << ", " << cube << ", " << close;
    // Small bricks have many points on their faces, where edges are fewer.
    if (cube >= 16) {
      EXPECT_LE(static_cast<double>(stated), 2.5 * static_cast<double>(peak.bytes()))
          << cube << ", " << close;
    }
    EXPECT_LE(surface.vertices.size(), most_surface_vertices(box.size()));
    EXPECT_LE(surface.triangles.size(), most_surface_triangles(box.size()));
  }
}

TEST(SurfaceBytes, AreWhatIsStatedForNoise) {
  if (sanitized) GTEST_SKIP() << "a sanitizer allocates in its own way";
  check<std::uint8_t>(32, {2, 2, 2}, {0, 0, 0});
  check<std::int16_t>(8, {2, 3, 2}, {3, 1, 7});
  check<float>(16, {2, 1, 2}, {0, 0, 1});
  check<double>(4, {2, 2, 2}, {3, 3, 3});
}

}  // namespace
}  // namespace tagrid
