#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <map>
#include <set>

#include "stages/mesh/cut.h"
#include "stages/mesh/plane_edges.h"
#include "stages/mesh/tetrahedra.h"
#include "tests/support/conforming_activity.h"
#include "tests/support/mesh_laws.h"

namespace tagrid {
namespace {

template <class Visit>
void for_each_descendant(const BisectionStep& step, int deepest, Visit visit) {
  visit(step);
  if (step.level == deepest) return;
  for_each_descendant(step.half(step.midpoint(), 0), deepest, visit);
  for_each_descendant(step.half(step.midpoint(), 1), deepest, visit);
}

// Each of the finest tetrahedra lies in one cell of the lattice: the border cuts none of them.
std::int64_t six_volumes_inside(const BisectionStep& step, const Box& volume, int deepest) {
  std::int64_t sum = 0;
  for_each_descendant(step, deepest, [&](const BisectionStep& s) {
    if (s.level == deepest && !reaches_beyond(s.vertices, volume)) sum += std::abs(six_volumes(s.vertices));
  });
  return sum;
}

// Every tetrahedron of a root cube of edge 4, and every possible position of the planes.
TEST(Cut, PiecesFillExactlyWhatLiesInTheVolume) {
  const int s = 4, deepest = max_level(s);
  std::int64_t cut = 0, most = 0;
  for (const BisectionStep& root : root_tetrahedra({0, 0, 0}, s))
    for_each_descendant(root, deepest, [&](const BisectionStep& step) {
      for_each_point({{0, 0, 0}, {1, 1, 1}}, [&](Index3 first) {
        for_each_point({first, {s, s, s}}, [&](Index3 last) {
          const Box volume{first, last};
          const Pieces pieces = cut_at(step.vertices, volume);
          std::int64_t sum = 0;
          for (const auto& piece : pieces) {
            ASSERT_GT(six_volumes(piece), 0);
            ASSERT_FALSE(reaches_beyond(piece, volume));
            sum += six_volumes(piece);
          }
          ASSERT_EQ(sum, six_volumes_inside(step, volume, deepest));
          cut += pieces.count > 0 && reaches_beyond(step.vertices, volume);
          most = std::max(most, static_cast<std::int64_t>(pieces.count));
        });
      });
    });
  EXPECT_GT(cut, 1000);
  EXPECT_GE(most, 6);
}

TEST(Cut, ATetrahedronInTheVolumeStaysWhole) {
  for (const BisectionStep& root : root_tetrahedra({8, 0, 16}, 8))
    for_each_descendant(root, 5, [&](const BisectionStep& step) {
      const Pieces pieces = cut_at(step.vertices, {{0, 0, 0}, {16, 8, 24}});
      ASSERT_EQ(pieces.count, 1u);
      ASSERT_EQ(six_volumes(pieces.vertices[0]), std::abs(six_volumes(step.vertices)));
    });
}

// The pieces of all leaves of `active`, as a mesh.
LatticeMesh cut_mesh(const LatticeBits& active, int cube_size, const Box& volume) {
  LatticeMesh mesh;
  std::map<std::array<std::int64_t, 3>, std::int64_t> ids;
  for_each_leaf_tetrahedron(active, active.box(), cube_size, max_level(cube_size), [&](const Tetrahedron& t) {
    for (const auto& piece : cut_at(t.vertices, volume)) {
      for (Index3 p : piece) {
        const auto [at, is_new] =
            ids.emplace(std::array{p.x, p.y, p.z}, static_cast<std::int64_t>(ids.size()));
        if (is_new) mesh.points.push_back(p);
        mesh.connectivity.push_back(at->second);
      }
      mesh.levels.push_back(static_cast<std::uint8_t>(t.level));
      mesh.types.push_back(static_cast<std::uint8_t>(t.type()));
    }
  });
  return mesh;
}

void expect_conforming(const LatticeBits& active, int cube_size, const Box& volume) {
  const LatticeMesh mesh = cut_mesh(active, cube_size, volume);
  std::int64_t inner_open_faces = 0;
  const MeshFindings found = check_mesh(
      mesh,
      [&](const std::array<std::size_t, 3>& f) {
        inner_open_faces += !is_on_border({mesh.points[f[0]], mesh.points[f[1]], mesh.points[f[2]]}, volume);
      },
      volume);
  RC_ASSERT(found.good());
  RC_ASSERT(inner_open_faces == 0);
  const Index3 edges = volume.high - volume.low;
  RC_ASSERT(found.six_volumes == 6 * edges.x * edges.y * edges.z);
}

// Two root cubes along an axis are enough: of three or more, only the first and the last one would be cut.
RC_GTEST_PROP(Cut, LeavesStayConformingWhereverTheBorderIs, ()) {
  const int s = *rc::gen::element(4, 8, 16);
  Index3 high;
  Box volume;
  for (int axis = 0; axis < 3; ++axis) {
    high[axis] = s * *rc::gen::inRange(1, 3);
    volume.low[axis] = *rc::gen::inRange(0, 2);
    volume.high[axis] =
        *rc::gen::inRange<std::int64_t>(high[axis] - s + 1 + volume.low[axis], high[axis] + 1);
  }
  const LatticeBits active = random_conforming_activity(
      {{0, 0, 0}, high}, s, *rc::gen::element(0, 1, 5, 40, 300), *rc::gen::arbitrary<std::uint64_t>());
  expect_conforming(active, s, volume);
}

TEST(Cut, RootCubesStayConformingAtEveryPlaceOfTheBorder) {
  const int s = 8;
  const LatticeBits active = random_conforming_activity({{0, 0, 0}, {s, s, s}}, s, 0, 1);
  for_each_point({{1, 1, 1}, {s, s, s}}, [&](Index3 last) {
    expect_conforming(active, s, {{0, 0, 0}, last});
    if (last.x > 1 && last.y > 1 && last.z > 1) expect_conforming(active, s, {{1, 1, 1}, last});
  });
}

// The edges of the grid in a plane, against those of the polygons into which the plane cuts the leaves.

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
