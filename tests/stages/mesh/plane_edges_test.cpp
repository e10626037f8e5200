// The edges of the grid in a plane, against those of the polygons into which the plane cuts the leaves.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "stages/mesh/plane_edges.h"
#include "stages/mesh/tetrahedra.h"
#include "tests/support/conforming_activity.h"

namespace tagrid {
namespace {

/// The corners of a tetrahedron's polygon, in order around its middle; fewer than three if it has no area.
std::vector<PlacePlane> polygon_of(const Tetrahedron& t, int axis, std::int64_t at) {
  std::set<PlacePlane> corners;
  for (const Index3& a : t.vertices)
    for (const Index3& b : t.vertices) {
      // Of an edge from below the plane to above, or of a vertex in it.
      const double length = static_cast<double>(b[axis] - a[axis]);
      if (a[axis] != at && !(a[axis] < at && at < b[axis])) continue;
      const double way = a[axis] == at ? 0 : static_cast<double>(at - a[axis]) / length;
      std::int64_t coordinates[2];
      for (int i = 0; i < 2; ++i) {
        const int other = (i < axis) ? i : i + 1;
        coordinates[i] =
            std::llround(static_cast<double>(a[other]) + way * static_cast<double>(b[other] - a[other]));
      }
      corners.insert({coordinates[0], coordinates[1]});
    }
  if (corners.size() < 3) return {};
  double u = 0, v = 0;
  for (const PlacePlane& p : corners) {
    u += static_cast<double>(p.across) / static_cast<double>(corners.size());
    v += static_cast<double>(p.down) / static_cast<double>(corners.size());
  }
  std::vector<PlacePlane> around(corners.begin(), corners.end());
  std::sort(around.begin(), around.end(), [&](const PlacePlane& p, const PlacePlane& q) {
    const auto angle = [&](const PlacePlane& r) {
      return std::atan2(static_cast<double>(r.down) - v, static_cast<double>(r.across) - u);
    };
    return angle(p) < angle(q);
  });
  return around;
}

RC_GTEST_PROP(EdgesInPlane, AreThoseOfThePolygonsOfAllLeaves, ()) {
  const int cube_size = *rc::gen::element(4, 8, 16);
  const auto cubes = [&] { return std::int64_t{*rc::gen::inRange(1, 3)} * cube_size; };
  const Index3 low = cube_size * Index3{1, 0, 2};
  const Box box = {low, low + Index3{cubes(), cubes(), cubes()}};
  const LatticeBits active = random_conforming_activity(box, cube_size, *rc::gen::element(0, 1, 5, 40, 1000),
                                                        *rc::gen::arbitrary<std::uint64_t>());
  const int axis = *rc::gen::inRange(0, 3);
  const std::int64_t at = *rc::gen::inRange(box.low[axis], box.high[axis] + 1);
  std::set<PlaneEdge> expected;
  for_each_leaf_tetrahedron(active, box, cube_size, max_level(cube_size), [&](const Tetrahedron& t) {
    const std::vector<PlacePlane> polygon = polygon_of(t, axis, at);
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const PlacePlane &a = polygon[i], &b = polygon[i + 1 == polygon.size() ? 0 : i + 1];
      expected.insert(a < b ? PlaneEdge{a, b} : PlaneEdge{b, a});
    }
  });
  const std::vector<PlaneEdge> found = edges_in_plane(active, cube_size, axis, at);
  RC_ASSERT(found == std::vector<PlaneEdge>(expected.begin(), expected.end()));
}

}  // namespace
}  // namespace tagrid
