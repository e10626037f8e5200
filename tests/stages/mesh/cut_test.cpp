#include "stages/mesh/cut.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <map>

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

}  // namespace
}  // namespace tagrid
