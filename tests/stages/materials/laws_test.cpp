// The laws of meshes with materials, checked on entire meshes of volumes that are awkward in different ways.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "stages/materials/dihedral_angles.h"
#include "tests/support/material_volumes.h"

namespace tagrid {
namespace {

__extension__ using Wide = __int128;

Wide six_volumes_of(const MeshInMemory& mesh, const MeshInMemory::Tetrahedron& t) {
  const Index3 a = mesh.at(t, 1) - mesh.at(t, 0), b = mesh.at(t, 2) - mesh.at(t, 0),
               c = mesh.at(t, 3) - mesh.at(t, 0);
  return Wide{a.x} * (Wide{b.y} * c.z - Wide{b.z} * c.y) + Wide{a.y} * (Wide{b.z} * c.x - Wide{b.x} * c.z) +
         Wide{a.z} * (Wide{b.x} * c.y - Wide{b.y} * c.x);
}

using Face = std::array<std::int64_t, 3>;
using Edge = std::array<std::int64_t, 2>;

/// The materials on the sides of each face; one that is outside of the volume is -1.
std::map<Face, std::vector<int>> faces_of(const MeshInMemory& mesh) {
  std::map<Face, std::vector<int>> faces;
  for (const auto& t : mesh.tetrahedra)
    for (std::size_t opposite = 0; opposite < 4; ++opposite) {
      Face face{};
      for (std::size_t i = 0, k = 0; i < 4; ++i)
        if (i != opposite) face[k++] = t.vertices[i];
      std::sort(face.begin(), face.end());
      faces[face].push_back(t.material);
    }
  return faces;
}

bool is_at_end(const MeshInMemory& mesh, const Face& face, const MaterialLattice& lattice) {
  for (int axis = 0; axis < 3; ++axis)
    for (const std::int64_t plane : {std::int64_t{0}, lattice.last[axis] * parts_per_point})
      if (std::all_of(face.begin(), face.end(), [&](auto v) { return mesh.positions.at(v)[axis] == plane; }))
        return true;
  return false;
}

std::array<Edge, 3> edges_of(const Face& f) { return {{{f[0], f[1]}, {f[0], f[2]}, {f[1], f[2]}}}; }

struct Findings {
  AngleRange angles;
  std::set<int> materials;
  /// V - E + F of the faces between materials.
  std::int64_t euler_number = 0;
  /// The part of the volume that each material has.
  std::map<int, double> parts;
};

// Checks what is true of every mesh.
Findings check(const MaterialVolume& volume, const MeshInMemory& mesh) {
  const MaterialLattice lattice = volume.lattice();
  Findings found;
  Wide sum = 0;
  std::int64_t not_positive = 0;
  std::map<int, Wide> sums;
  for (const auto& t : mesh.tetrahedra) {
    const Wide v = six_volumes_of(mesh, t);
    not_positive += v <= 0;
    sum += v;
    sums[t.material] += v;
    std::array<std::array<double, 3>, 4> x{};
    for (std::size_t i = 0; i < 4; ++i)
      for (int a = 0; a < 3; ++a) x[i][static_cast<std::size_t>(a)] = static_cast<double>(mesh.at(t, i)[a]);
    found.angles.add(dihedral_angles(x));
  }
  EXPECT_EQ(not_positive, 0);
  Wide box = 6;
  for (int a = 0; a < 3; ++a) box *= lattice.last[a] * parts_per_point;
  EXPECT_TRUE(sum == box) << "the volumes do not add up to that of the box";
  for (const auto& [material, six] : sums) {
    found.materials.insert(material);
    found.parts[material] = static_cast<double>(six) / static_cast<double>(box);
  }
  const bool has_best = volume.rule.way < closest_vertices.way;
  EXPECT_GE(found.angles.smallest, has_best ? 12.6 : 9.2);
  EXPECT_LE(found.angles.largest, has_best ? 155.7 : 161.7);

  std::int64_t open = 0, crowded = 0, odd = 0;
  std::map<std::pair<int, Edge>, int> borders;  // how many faces of the border of a material an edge has
  std::set<std::int64_t> vertices;
  std::set<Edge> edges;
  std::int64_t between = 0;
  for (const auto& [face, sides] : faces_of(mesh)) {
    crowded += sides.size() > 2;
    if (sides.size() == 1) open += !is_at_end(mesh, face, lattice);
    if (sides.size() == 2 && sides[0] != sides[1]) {
      ++between;
      for (const std::int64_t v : face) vertices.insert(v);
      for (const Edge& e : edges_of(face)) edges.insert(e);
    }
    if (sides.size() == 2 && sides[0] == sides[1]) continue;
    for (const int side : sides)
      for (const Edge& e : edges_of(face)) ++borders[{side, e}];
  }
  for (const auto& [of, count] : borders) odd += count % 2;
  EXPECT_EQ(open, 0) << "faces have one tetrahedron, and are not at the end";
  EXPECT_EQ(crowded, 0) << "faces have more than two tetrahedra";
  EXPECT_EQ(odd, 0) << "the border of a material is not closed";
  found.euler_number =
      static_cast<std::int64_t>(vertices.size()) - static_cast<std::int64_t>(edges.size()) + between;
  return found;
}

Findings check(const MaterialVolume& volume) { return check(volume, mesh_of(volume)); }

double distance(double x, double y, double z) { return std::sqrt(x * x + y * y + z * z); }

MaterialVolume sphere(double edge) {
  MaterialVolume v{{41, 39, 37}};
  v.edge = edge;
  v.thresholds = {0};
  v.fill([](double x, double y, double z) { return 12 - distance(x - 19.3, y - 18.9, z - 17.7); });
  return v;
}

TEST(MaterialMeshLaws, Sphere) {
  for (const double edge : {1.0, 2.0, 2.7}) {
    const MaterialVolume volume = sphere(edge);
    const Findings found = check(volume);
    EXPECT_EQ(found.euler_number, 2) << edge;
    const Index3 last = volume.lattice().last;
    const double box = static_cast<double>(last.x * last.y * last.z) * std::pow(edge / 2, 3);
    EXPECT_NEAR(found.parts.at(1) * box, 4 / 3.0 * 3.14159265 * 12 * 12 * 12, 0.03 * 7238) << edge;
    EXPECT_GT(found.angles.smallest, 18) << edge;
  }
}

TEST(MaterialMeshLaws, TheInterfaceIsWhereTheValueIs) {
  const MaterialVolume volume = sphere(2);
  const MeshInMemory mesh = mesh_of(volume);
  std::int64_t checked = 0;
  for (const auto& [face, sides] : faces_of(mesh)) {
    if (sides.size() < 2 || sides[0] == sides[1]) continue;
    for (const std::int64_t v : face) {
      const Index3 p = mesh.positions.at(v);
      EXPECT_NEAR(volume.field().value_at(p), 0, 1e-3) << p.x << ' ' << p.y << ' ' << p.z;
      ++checked;
    }
  }
  EXPECT_GT(checked, 1000);
}

TEST(MaterialMeshLaws, Torus) {
  MaterialVolume volume{{49, 49, 25}};
  volume.thresholds = {0};
  volume.fill([](double x, double y, double z) {
    const double around = std::sqrt((x - 24) * (x - 24) + (y - 24) * (y - 24)) - 14;
    return 5 - std::sqrt(around * around + (z - 12) * (z - 12));
  });
  EXPECT_EQ(check(volume).euler_number, 0);
}

TEST(MaterialMeshLaws, ThickSlices) {
  MaterialVolume volume{{41, 41, 17}, {1, 1, 2.5}};
  volume.thresholds = {0};
  volume.fill([](double x, double y, double z) { return 14 - distance(x - 20, y - 20, z - 20); });
  const Findings found = check(volume);
  EXPECT_EQ(found.euler_number, 2);
  EXPECT_GT(found.angles.smallest, 18);
}

MaterialVolume noise(Index3 dims, double edge, std::vector<float> thresholds, unsigned seed) {
  MaterialVolume volume{dims};
  volume.edge = edge;
  volume.thresholds = std::move(thresholds);
  std::mt19937 random(seed);
  volume.fill([&](double, double, double) { return random() % 65536 / 65536.0; });
  return volume;
}

TEST(MaterialMeshLaws, NoiseOfTwoMaterials) {
  check(noise({21, 19, 23}, 1, {0.5F}, 1));
  check(noise({35, 40, 33}, 1.6, {0.7F}, 2));
}

TEST(MaterialMeshLaws, NoiseWithTheRuleForBestAngles) {
  for (MaterialVolume volume :
       {noise({31, 29, 33}, 1, {0.5F}, 9), noise({21, 19, 23}, 2, {0.25F, 0.5F, 0.75F}, 3)}) {
    volume.rule = best_angles;
    check(volume);
  }
}

TEST(MaterialMeshLaws, NoiseOfFourMaterials) {
  EXPECT_EQ(check(noise({21, 19, 23}, 1, {0.25F, 0.5F, 0.75F}, 3)).materials.size(), 4U);
  check(noise({35, 40, 33}, 1.6, {0.4F, 0.5F, 0.6F}, 4));
}

TEST(MaterialMeshLaws, Checkerboard) {
  MaterialVolume volume{{17, 17, 17}};
  volume.edge = 1;
  volume.fill([](double x, double y, double z) { return static_cast<int>(x + y + z) % 2; });
  check(volume);
  // All cubes' centers are at the threshold exactly.
  volume.thresholds = {0.5F, 1};
  check(volume);
}

TEST(MaterialMeshLaws, PlateausAtTheThreshold) {
  for (const double edge : {1.0, 2.0}) {
    MaterialVolume volume{{25, 25, 25}};
    volume.edge = edge;
    volume.thresholds = {2, 3};
    volume.fill([](double x, double y, double z) {
      return std::floor(x / 5) + (static_cast<int>(y) % 7 == 3) - (static_cast<int>(z) % 5 == 0);
    });
    check(volume);
  }
}

TEST(MaterialMeshLaws, LabelsWithPlanesBetweenSamples) {
  MaterialVolume volume{{33, 33, 33}};
  volume.fill([](double x, double y, double z) { return (x > 10) + (y > 15) + (z > 20) > 1; });
  check(volume);
}

TEST(MaterialMeshLaws, ThinAndCrossingPlates) {
  for (const double edge : {1.0, 2.0, 4.0}) {
    MaterialVolume volume{{33, 29, 31}};
    volume.edge = edge;
    volume.fill([](double x, double y, double z) {
      return std::abs(x - 13) < 1.5 || std::abs(y - 0.7 * z - 4) < 0.8 || (z == 17 && y > 3);
    });
    check(volume);
  }
}

TEST(MaterialMeshLaws, OneVoxelAndConstantVolumes) {
  for (const double edge : {1.0, 2.0, 3.0}) {
    MaterialVolume volume{{17, 18, 19}};
    volume.edge = edge;
    volume.fill([](double x, double y, double z) { return x == 8 && y == 8 && z == 8 ? 10 : 0; });
    check(volume);
    volume.fill([](double, double, double) { return 0.5; });
    EXPECT_EQ(check(volume).materials, std::set<int>{1});
  }
  MaterialVolume small{{2, 2, 2}};
  small.edge = 1;
  small.fill([](double x, double y, double) { return x * y; });
  check(small);
}

TEST(MaterialMeshLaws, SameMeshForAllBricks) {
  const auto sorted = [](MeshInMemory mesh) {
    std::sort(mesh.tetrahedra.begin(), mesh.tetrahedra.end());
    return mesh;
  };
  const MaterialVolume volumes[] = {noise({13, 11, 10}, 1, {0.5F}, 5), noise({45, 27, 33}, 2, {0.99F}, 6),
                                    sphere(2.7)};
  for (MaterialVolume volume : volumes)
    for (const auto& [cube_size, edge] : {std::pair{4, 2}, {8, 1}, {16, 1}, {16, 2}, {32, 1}}) {
      volume.cube_size = cube_size;
      const MeshInMemory whole = sorted(mesh_of(volume)), of_bricks = sorted(mesh_of(volume, edge));
      EXPECT_TRUE(whole.tetrahedra == of_bricks.tetrahedra) << cube_size << ' ' << edge;
      EXPECT_TRUE(whole.positions == of_bricks.positions) << cube_size << ' ' << edge;
    }
}

TEST(MaterialMeshLaws, FewerTetrahedraWhereThereIsOneMaterial) {
  MaterialVolume volume = sphere(1);
  volume.cube_size = 32;
  const MeshInMemory mesh = mesh_of(volume);
  check(volume, mesh);
  EXPECT_LT(mesh.tetrahedra.size(), 12 * 40 * 38 * 36 / 4);
}

}  // namespace
}  // namespace tagrid
