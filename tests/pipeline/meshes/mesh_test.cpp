#include "pipeline/meshes/mesh.h"

#include <set>

#include "io/errors/errors.h"
#include "stages/grid/lattice.h"
#include "stages/mesh/cut.h"
#include "stages/mesh/tetrahedra.h"
#include "stages/values/points/coding.h"
#include "tests/support/mesh_field.h"
#include "tests/support/meshed_volume.h"
#include "tests/support/sanitized.h"

namespace tagrid {
namespace {

struct Case {
  Index3 dims;
  int cube_size, brick_edge;
  bool grid_only, phantom;
  int lead;

  Domain domain() const { return {dims, cube_size, lead}; }
};

std::ostream& operator<<(std::ostream& out, const Case& c) {
  return out << c.dims.x << "x" << c.dims.y << "x" << c.dims.z << " S " << c.cube_size << " brick "
             << c.brick_edge << (c.grid_only ? " grid" : " voxels") << (c.phantom ? " phantom" : " spikes")
             << " lead " << c.lead;
}

// Every size with every cube and brick; modes and contents alternate, so that all pairs occur. With sanitizers,
// each size has one of the cubes and bricks.
std::vector<Case> all_cases() {
  const Index3 sizes[] = {{1, 1, 1},    {1, 1, 23},  {17, 1, 10}, {2, 19, 3},  {9, 9, 9}, {10, 11, 12},
                          {13, 17, 18}, {21, 6, 25}, {33, 12, 7}, {5, 25, 17}, {2, 2, 2}, {14, 15, 30}};
  std::vector<Case> cases;
  int row = 0;
  for (const Index3& dims : sizes) {
    int i = row++;
    for (const int cube_size : {4, 8})
      for (const int brick_edge : {1, 2}) {
        const bool left_out = sanitized && (cube_size / 4 + brick_edge + row) % 4 != 0;
        if (!left_out)
          for (const int lead : {0, 1})
            cases.push_back({dims, cube_size, brick_edge, i % 2 == 0, i / 2 % 2 == 0, lead});
        ++i;
      }
  }
  return cases;
}

std::array<Index3, 3> corners(const LatticeMesh& mesh, const std::array<std::size_t, 3>& ids) {
  return {mesh.points[ids[0]], mesh.points[ids[1]], mesh.points[ids[2]]};
}

using SortedTetrahedron = std::array<std::array<std::int64_t, 3>, 4>;

std::set<SortedTetrahedron> as_set(const LatticeMesh& mesh) {
  std::set<SortedTetrahedron> set;
  for (std::size_t t = 0; t < mesh.size(); ++t) {
    SortedTetrahedron key;
    for (std::size_t i = 0; i < 4; ++i) {
      const Index3 p = mesh.vertices(t)[i];
      key[i] = {p.x, p.y, p.z};
    }
    std::sort(key.begin(), key.end());
    set.insert(key);
  }
  return set;
}

class MeshLaws : public MeshedVolume, public ::testing::WithParamInterface<Case> {
 protected:
  MeshLaws() {
    const Case& c = GetParam();
    const auto seed = static_cast<std::uint64_t>(c.dims.x + 100 * c.dims.y + c.cube_size);
    volume_ = c.phantom ? phantom_volume(c.dims, seed) : spiky_volume(c.dims, seed);
    options_.cube_size = c.cube_size;
    options_.brick_edge = c.brick_edge;
    options_.lead = c.lead;
    options_.grid_only = c.grid_only;
    // With a bound, so that stored values differ from the original ones, and samples from the decoded ones.
    options_.max_error = 9;
    if (!c.grid_only) options_.mesh_error = 150;
    encoded_ = encode(volume_, options_);
  }

  // Checks that the mesh is conforming and fills the whole number of root cubes.
  void expect_filled(const LatticeMesh& m) const {
    const Box padded = GetParam().domain().padded();
    const Index3 edges = padded.high;
    std::int64_t inner_open_faces = 0;
    const MeshFindings found =
        check_mesh(m, [&](const auto& face) { inner_open_faces += !is_on_border(corners(m, face), padded); });
    EXPECT_TRUE(found.good()) << found.text();
    EXPECT_EQ(found.six_volumes, 6 * edges.x * edges.y * edges.z);
    EXPECT_EQ(inner_open_faces, 0);
  }

  TestVolume volume_;
  EncodeOptions options_;
  EncodeResult encoded_;
};

TEST_P(MeshLaws, PaddedIsConformingAndFillsTheRootCubesAtEveryLevel) {
  const int deepest = max_level(GetParam().cube_size);
  std::uint64_t active = 0;
  for (int level = 0; level <= deepest; ++level) {
    SCOPED_TRACE(level);
    const ValuedMesh m = mesh(level, true);
    expect_filled(m);
    active += encoded_.index.total.active[static_cast<std::size_t>(level)];
    EXPECT_EQ(m.points.size(), active);
    for (Index3 p : m.points) EXPECT_LE(classify(p, GetParam().cube_size).level, level);
    const std::int64_t root =
        std::int64_t{GetParam().cube_size} * GetParam().cube_size * GetParam().cube_size;
    for (std::size_t t = 0; t < m.size(); ++t) EXPECT_EQ(six_volumes(m.vertices(t)) << m.levels[t], root);
    EXPECT_LE(*std::max_element(m.levels.begin(), m.levels.end()), level);
  }
  EXPECT_EQ(as_set(mesh({}, true)), as_set(mesh(deepest, true)));
}

// Six volumes of all tetrahedra of each level.
using Volumes = std::array<std::int64_t, 25>;

TEST_P(MeshLaws, WithoutPaddingTheBoxOfTheSamplesIsFilledExactlyAtEveryLevel) {
  const Box volume = GetParam().domain().volume();
  const Index3 edges = volume.high - volume.low;
  if (edges.x * edges.y * edges.z == 0) {
    EXPECT_THROW(mesh({}, false), UsageError) << "there is nothing to fill";
    return;
  }
  for (int level = 0; level <= max_level(GetParam().cube_size); ++level) {
    SCOPED_TRACE(level);
    const ValuedMesh all = mesh(level, true), kept = mesh(level, false);
    std::int64_t inner_open_faces = 0;
    const MeshFindings found = check_mesh(
        kept, [&](const auto& face) { inner_open_faces += !is_on_border(corners(kept, face), volume); },
        volume);
    EXPECT_TRUE(found.good()) << found.text();
    EXPECT_EQ(inner_open_faces, 0);
    EXPECT_EQ(found.six_volumes, 6 * edges.x * edges.y * edges.z);
    for (Index3 p : kept.points) ASSERT_TRUE(volume.contains(p));

    Volumes expected{}, volumes{};
    for (std::size_t t = 0; t < all.size(); ++t)
      for (const auto& piece : cut_at(all.vertices(t), volume)) expected[all.levels[t]] += six_volumes(piece);
    for (std::size_t t = 0; t < kept.size(); ++t) volumes[kept.levels[t]] += six_volumes(kept.vertices(t));
    EXPECT_EQ(volumes, expected) << "a piece has another level than what it was cut from";
  }
}

TEST_P(MeshLaws, ACutPointHasTheRoundedValueOfTheFieldAtEveryLevel) {
  const Index3& dims = GetParam().dims;
  if (dims.x == 1 || dims.y == 1 || dims.z == 1) return;
  const Box box = GetParam().domain().volume();
  for (int level = 0; level <= max_level(GetParam().cube_size); ++level) {
    const ValuedMesh all = mesh(level, true), kept = mesh(level, false);
    std::int64_t disagree = 0;
    const std::vector<Fraction> field = field_of_mesh(all, all.values, box, disagree);
    ASSERT_EQ(disagree, 0);
    for (std::size_t i = 0; i < kept.points.size(); ++i)
      ASSERT_EQ(kept.values[i], field[static_cast<std::size_t>(box.offset(kept.points[i]))].rounded());
  }
}

TEST_P(MeshLaws, ValuesAreTheDecodedSamplesOrTheStoredPoints) {
  const auto point_error = static_cast<std::int64_t>(encoded_.header.parameters.point_error);
  const TestVolume decoded = decode(GetParam().dims);
  const ValuedMesh m = mesh({}, true);
  for (std::size_t i = 0; i < m.points.size(); ++i) {
    const Index3 p = m.points[i] - GetParam().domain().first();
    const std::int16_t expected =
        GetParam().grid_only ? stored_point(volume_.nearest(p), point_error) : decoded.nearest(p);
    ASSERT_EQ(m.values[i], expected) << p.x << " " << p.y << " " << p.z;
    if (Box::of_size(GetParam().dims).contains(p)) {
      ASSERT_EQ(m.values[i], decoded.nearest(p));
    }
  }
}

TEST_P(MeshLaws, TheFieldOfAGridAloneIsTheDecodedVolume) {
  if (!GetParam().grid_only) return;
  const TestVolume decoded = decode(GetParam().dims);
  const ValuedMesh m = mesh({}, true);
  const Box box = GetParam().domain().volume();
  std::int64_t disagree = 0;
  const std::vector<Fraction> field = field_of_mesh(m, m.values, box, disagree);
  EXPECT_EQ(disagree, 0);
  for (std::size_t i = 0; i < field.size(); ++i) {
    ASSERT_NE(field[i].whole, 0) << "a sample is in no tetrahedron";
    ASSERT_EQ(field[i].rounded(), decoded.samples[i]);
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, MeshLaws, ::testing::ValuesIn(all_cases()));

}  // namespace
}  // namespace tagrid
