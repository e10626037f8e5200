#include "stages/surface/cases.h"

#include <gtest/gtest.h>

#include <set>

#include "stages/grid/tetrahedron.h"

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

}  // namespace
}  // namespace tagrid
