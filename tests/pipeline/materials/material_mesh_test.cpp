// Meshes with materials that were made in bricks from a file, against those that the kernel makes of the whole volume
// in memory, and against the laws of their surfaces.
#include "pipeline/materials/material_mesh.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/files/open_source.h"
#include "pipeline/materials/bricks.h"
#include "pipeline/materials/settings.h"
#include "pipeline/parts/mesh_parts.h"
#include "pipeline/parts/work_orders.h"
#include "tests/support/counted_heap.h"
#include "tests/support/fake_ranks.h"
#include "tests/support/material_volumes.h"
#include "tests/support/runs.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

template <class Number>
std::vector<Number> numbers_of(SpoolFile& file) {
  std::vector<std::byte> bytes(file.size());
  file.read_at(0, bytes);
  std::vector<Number> numbers(bytes.size() / sizeof(Number));
  for (std::size_t i = 0; i < numbers.size(); ++i)
    numbers[i] = load_little_endian<Number>(bytes.data() + i * sizeof(Number));
  return numbers;
}

/// A mesh that was read back.
struct Mesh {
  explicit Mesh(MadeMaterialMesh result_) : result(std::move(result_)) {
    points = numbers_of<double>(mesh().points);
    nodes = numbers_of<std::int64_t>(mesh().nodes);
    face_nodes = numbers_of<std::int64_t>(mesh().face_nodes);
    faces = numbers_of<std::int64_t>(mesh().faces);
  }
  MaterialMesh& mesh() { return result.mesh; }
  const MaterialMesh& mesh() const { return result.mesh; }
  std::array<double, 3> point(std::int64_t i) const {
    const auto at = 3 * static_cast<std::size_t>(i);
    return {points[at], points[at + 1], points[at + 2]};
  }
  std::int64_t elements() const {
    return static_cast<std::int64_t>(nodes.size() / mesh().nodes_of_element());
  }
  std::int64_t node(std::int64_t element, std::size_t i) const {
    return nodes[static_cast<std::size_t>(element) * mesh().nodes_of_element() + i];
  }
  std::string material(std::int64_t element) const {
    for (const MaterialElements& m : mesh().materials)
      if (element >= m.first && element < m.first + m.count) return m.name;
    return "none";
  }

  MadeMaterialMesh result;
  std::vector<double> points;
  std::vector<std::int64_t> nodes, face_nodes, faces;
};

std::array<double, 3> minus(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
std::array<double, 3> cross_of(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double dot_of(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

class MaterialMeshOfFile : public TemporaryFolder {
 protected:
  /// Encodes samples; `lines` are those of an NRRD header.
  template <class T>
  std::string encoded(const std::string& name, Index3 dims, const std::vector<T>& samples,
                      const std::string& lines, const char* type, int brick = 2) const {
    const std::string head = "NRRD0004\ntype: " + std::string(type) +
                             "\ndimension: 3\nsizes: " + std::to_string(dims.x) + " " +
                             std::to_string(dims.y) + " " + std::to_string(dims.z) +
                             "\nencoding: raw\nendian: little\n" + lines + "\n";
    const auto* bytes = reinterpret_cast<const char*>(samples.data());
    EncodeOptions options;
    options.brick_edge = brick;
    encode_volume(file("v.nrrd", head + std::string(bytes, samples.size() * sizeof(T))), SourceDescription(),
                  path(name), true, options, Resources(2));
    return path(name);
  }
  std::string encoded(const MaterialVolume& v, int brick = 2) const {
    const std::string spacings = "spacings: " + std::to_string(v.spacing[0]) + " " +
                                 std::to_string(v.spacing[1]) + " " + std::to_string(v.spacing[2]) + "\n";
    return encoded("v.tag", v.dims, v.values, spacings, "float", brick);
  }
  Mesh mesh(const std::string& tag, const MaterialMeshOptions& options, int threads = 2) const {
    const TagBricks bricks(open_source(tag));
    const Geometry geometry = bricks.header().metadata.geometry();
    return Mesh(make_material_mesh(bricks, settle_material_mesh(bricks, geometry, options), geometry, options,
                                   {path(""), "the mesh"}, Resources(threads)));
  }
};

MaterialMeshOptions options_for(const MaterialVolume& v) {
  MaterialMeshOptions options;
  double low = -INFINITY;
  for (std::size_t i = 0; i <= v.thresholds.size(); ++i) {
    const double high = i < v.thresholds.size() ? static_cast<double>(v.thresholds[i]) : INFINITY;
    options.ranges.push_back({"m" + std::to_string(i), low, high});
    low = high;
  }
  options.fine = {v.edge, ""};
  options.coarse = {v.edge * v.cube_size / 2, ""};
  return options;
}

double distance(double x, double y, double z) { return std::sqrt(x * x + y * y + z * z); }

/// Two balls of two materials that overlap, in a box that one of them crosses.
MaterialVolume balls() {
  MaterialVolume v{{75, 60, 66}};
  v.spacing = {1, 1.25, 1};
  v.edge = 1.5;
  v.thresholds = {0, 5};
  v.cube_size = 8;
  v.fill([](double x, double y, double z) {
    return std::max(20 - distance(x - 25, y - 35, z - 30), 12 - distance(x - 60, y - 30, z - 55));
  });
  return v;
}

using Corners = std::set<std::array<double, 3>>;

TEST_F(MaterialMeshOfFile, IsThatOfTheWholeVolume) {
  MaterialVolume volume = balls();
  const Mesh mesh = this->mesh(encoded(volume), options_for(volume));
  const MaterialMesh& found = mesh.mesh();
  ASSERT_EQ(found.materials.size(), 3U);
  const auto oracle = mesh_of(volume);
  std::set<std::pair<std::string, Corners>> wanted, made;
  const auto world = [&](Index3 p) {
    std::array<double, 3> w;
    for (int a = 0; a < 3; ++a)
      w[static_cast<std::size_t>(a)] =
          std::round(static_cast<double>(p[a]) / parts_per_point * volume.edge / 2 * 1e9);
    return w;
  };
  for (const auto& t : oracle.tetrahedra) {
    Corners corners;
    for (std::size_t i = 0; i < 4; ++i) corners.insert(world(oracle.at(t, i)));
    wanted.emplace("m" + std::to_string(t.material), corners);
  }
  for (std::int64_t e = 0; e < mesh.elements(); ++e) {
    Corners corners;
    for (std::size_t i = 0; i < 4; ++i) {
      auto w = mesh.point(mesh.node(e, i));
      for (double& c : w) c = std::round(c * 1e9);
      corners.insert(w);
    }
    made.emplace(mesh.material(e), corners);
  }
  EXPECT_EQ(mesh.elements(), static_cast<std::int64_t>(oracle.tetrahedra.size()));
  EXPECT_EQ(found.point_count(), static_cast<std::int64_t>(oracle.positions.size()));
  EXPECT_TRUE(wanted == made);
}

// Checks what is true of all surfaces: each face where a material ends is in exactly one, as its elements have it.
void check_surfaces(const Mesh& mesh) {
  const MaterialMesh& m = mesh.mesh();
  std::map<std::set<std::int64_t>, std::vector<std::pair<std::int64_t, std::size_t>>> faces;
  for (std::int64_t e = 0; e < mesh.elements(); ++e) {
    const auto a = mesh.point(mesh.node(e, 0));
    EXPECT_GT(dot_of(minus(mesh.point(mesh.node(e, 1)), a),
                     cross_of(minus(mesh.point(mesh.node(e, 2)), a), minus(mesh.point(mesh.node(e, 3)), a))),
              0);
    for (std::size_t corner = 0; corner < 4; ++corner) {
      std::set<std::int64_t> face;
      for (std::size_t i = 0; i < 4; ++i)
        if (i != corner) face.insert(mesh.node(e, i));
      faces[face].emplace_back(e, corner);
    }
  }
  std::int64_t wrong = 0, ends = 0, crowded = 0;
  for (const auto& [face, sides] : faces) {
    crowded += sides.size() > 2;
    ends += sides.size() == 1 || mesh.material(sides[0].first) != mesh.material(sides[1].first);
  }
  EXPECT_EQ(crowded, 0);
  const std::size_t row = m.nodes_of_face();
  EXPECT_EQ(static_cast<std::int64_t>(mesh.face_nodes.size() / row), ends);
  std::set<std::set<std::int64_t>> seen;
  std::map<std::pair<std::string, std::set<std::int64_t>>, int> edges;
  std::set<std::string> names;
  std::int64_t next = 0;
  for (const MaterialSurface& surface : m.surfaces) {
    EXPECT_TRUE(names.insert(surface.name).second) << surface.name;
    EXPECT_EQ(surface.first, next);
    next += surface.count;
    EXPECT_GT(surface.count, 0);
    for (std::int64_t f = surface.first; f < next; ++f) {
      const auto at = static_cast<std::size_t>(f);
      const auto node = [&](std::size_t i) { return mesh.face_nodes[at * row + i]; };
      const std::set<std::int64_t> face = {node(0), node(1), node(2)};
      wrong += !seen.insert(face).second || !faces.contains(face);
      const std::int64_t front = mesh.faces[2 * at], back = mesh.faces[2 * at + 1];
      const auto& sides = faces[face];
      const auto has = [&](std::int64_t of_element) {
        return std::count(sides.begin(), sides.end(),
                          std::pair{of_element / 4, static_cast<std::size_t>(of_element % 4)}) == 1;
      };
      wrong += !has(front) || mesh.material(front / 4) != m.materials[surface.front].name;
      wrong += surface.back.has_value() != (back >= 0);
      if (back >= 0) wrong += !has(back) || mesh.material(back / 4) != m.materials[*surface.back].name;
      if (back < 0) wrong += sides.size() != 1;
      // Its normal points away from the corner that is not on it.
      const auto a = mesh.point(node(0)),
                 n = cross_of(minus(mesh.point(node(1)), a), minus(mesh.point(node(2)), a));
      wrong +=
          !(dot_of(n, minus(mesh.point(mesh.node(front / 4, static_cast<std::size_t>(front % 4))), a)) < 0);
      for (std::size_t i = 0; i < 3; ++i) {
        const std::set<std::int64_t> edge = {node(i), node((i + 1) % 3)};
        ++edges[{m.materials[surface.front].name, edge}];
        if (back >= 0) ++edges[{m.materials[*surface.back].name, edge}];
      }
      if (m.order == 1) continue;
      constexpr std::array<std::array<std::size_t, 2>, 3> ends = {{{0, 1}, {1, 2}, {0, 2}}};
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t k = 0; k < 3; ++k)
          wrong += mesh.point(node(3 + i))[k] !=
                   (mesh.point(node(ends[i][0]))[k] + mesh.point(node(ends[i][1]))[k]) / 2;
    }
  }
  EXPECT_EQ(wrong, 0);
  std::map<std::string, std::int64_t> touching;
  std::int64_t open = 0;
  for (const auto& [of, count] : edges) {
    open += count % 2;
    touching[of.first] += count > 2;
  }
  EXPECT_EQ(open, 0) << "a surface is not closed";
  for (const auto& q : mesh.result.quality.materials) EXPECT_EQ(q.touching_edges, touching[q.name]) << q.name;
}

TEST_F(MaterialMeshOfFile, HasEachFaceOfAMaterialInOneSurface) {
  MaterialVolume volume = balls();
  const std::string tag = encoded(volume);
  check_surfaces(mesh(tag, options_for(volume)));
  MaterialMeshOptions some = options_for(volume);
  some.keep = {"m1", "m2"};
  const Mesh two = mesh(tag, some);
  check_surfaces(two);
  std::set<std::string> names;
  for (const MaterialSurface& s : two.mesh().surfaces) names.insert(s.name);
  EXPECT_EQ(names, (std::set<std::string>{"m1_m0", "m1_m2", "m1_z_max"}));
}

TEST_F(MaterialMeshOfFile, HasNodesInTheMiddlesOfEdges) {
  MaterialVolume volume = balls();
  MaterialMeshOptions options = options_for(volume);
  const std::string tag = encoded(volume);
  const Mesh linear = mesh(tag, options);
  options.order = 2;
  const Mesh mesh = this->mesh(tag, options);
  EXPECT_EQ(mesh.elements(), linear.elements());
  constexpr std::array<std::array<std::size_t, 2>, 6> edges = {
      {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}}};
  std::map<std::set<std::int64_t>, std::int64_t> middles;
  std::int64_t wrong = 0;
  for (std::int64_t e = 0; e < mesh.elements(); ++e)
    for (std::size_t i = 0; i < 6; ++i) {
      const std::int64_t a = mesh.node(e, edges[i][0]), b = mesh.node(e, edges[i][1]),
                         middle = mesh.node(e, 4 + i);
      wrong += middles.emplace(std::set{a, b}, middle).first->second != middle;
      for (std::size_t k = 0; k < 3; ++k)
        wrong += mesh.point(middle)[k] != (mesh.point(a)[k] + mesh.point(b)[k]) / 2;
    }
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(mesh.mesh().point_count(),
            linear.mesh().point_count() + static_cast<std::int64_t>(middles.size()));
  check_surfaces(mesh);
}

TEST_F(MaterialMeshOfFile, IsTheSameForAllThreadsAndBricksOfTheFile) {
  MaterialVolume volume = balls();
  const MaterialMeshOptions options = options_for(volume);
  const Mesh first = mesh(encoded(volume, 1), options, 1);
  for (const int brick : {1, 2, 3})
    for (const int threads : {2, 8}) {
      const Mesh other = mesh(encoded(volume, brick), options, threads);
      EXPECT_TRUE(first.points == other.points && first.nodes == other.nodes && first.faces == other.faces &&
                  first.face_nodes == other.face_nodes);
    }
}

std::set<std::pair<std::string, Corners>> tetrahedra_of(const Mesh& mesh) {
  std::set<std::pair<std::string, Corners>> all;
  for (std::int64_t e = 0; e < mesh.elements(); ++e) {
    Corners corners;
    for (std::size_t i = 0; i < 4; ++i) corners.insert(mesh.point(mesh.node(e, i)));
    all.emplace(mesh.material(e), corners);
  }
  return all;
}

TEST_F(MaterialMeshOfFile, OfARegionIsAPartOfTheWhole) {
  MaterialVolume volume = balls();
  const std::string tag = encoded(volume);
  MaterialMeshOptions options = options_for(volume);
  const auto whole = tetrahedra_of(mesh(tag, options));
  options.region.low = {20, 10, 15};
  options.region.high = {50, 41, 40};
  const Mesh part = mesh(tag, options);
  check_surfaces(part);
  const auto in_part = tetrahedra_of(part);
  // The samples 20 to 49, 10 to 40 and 15 to 39, in the world.
  const std::array<double, 3> low = {20, 12.5, 15}, high = {49, 50, 39};
  std::set<std::pair<std::string, Corners>> wanted;
  for (const auto& t : whole) {
    bool meets = true;
    for (std::size_t a = 0; a < 3; ++a) {
      double least = INFINITY, most = -INFINITY;
      for (const auto& c : t.second) {
        least = std::min(least, c[a]);
        most = std::max(most, c[a]);
      }
      meets = meets && least <= high[a] + 1e-6 && most >= low[a] - 1e-6;
    }
    if (meets) wanted.insert(t);
  }
  EXPECT_TRUE(in_part == wanted);
}

TEST_F(MaterialMeshOfFile, LeavesOutLooseParts) {
  MaterialVolume volume{{70, 40, 40}};
  volume.thresholds = {0};
  volume.edge = 1;
  volume.cube_size = 8;
  volume.fill([](double x, double y, double z) {
    return std::max({9 - distance(x - 15, y - 20, z - 20), 5 - distance(x - 40, y - 20, z - 20),
                     2 - distance(x - 60, y - 11, z - 30)});
  });
  const std::string tag = encoded(volume);
  MaterialMeshOptions options = options_for(volume);
  options.keep = {"m1"};
  const auto volume_and_parts = [&](const PartsWish& wish) {
    options.parts = wish;
    const Mesh mesh = this->mesh(tag, options);
    check_surfaces(mesh);
    const auto& quality = mesh.result.quality;
    EXPECT_EQ(quality.materials.size(), 1U);
    EXPECT_EQ(quality.materials[0].tetrahedra, mesh.elements());
    EXPECT_EQ(quality.materials[0].parts + quality.materials[0].removed_parts, 3);
    // No point is left over.
    EXPECT_EQ(static_cast<std::int64_t>(std::set(mesh.nodes.begin(), mesh.nodes.end()).size()),
              mesh.mesh().point_count());
    return std::pair{quality.materials[0].volume, quality.materials[0].parts};
  };
  const auto ball = [](double r) { return 4 / 3.0 * 3.14159265 * r * r * r; };
  const auto all = volume_and_parts({}), two = volume_and_parts({false, 100}),
             one = volume_and_parts({true, 0});
  EXPECT_EQ(all.second, 3);
  EXPECT_EQ(two.second, 2);
  EXPECT_EQ(one.second, 1);
  // Polyhedra within balls are smaller.
  EXPECT_NEAR(all.first, ball(9) + ball(5) + ball(2), 0.02 * all.first);
  EXPECT_NEAR(two.first, ball(9) + ball(5), 0.02 * two.first);
  EXPECT_NEAR(one.first, ball(9), 0.02 * one.first);
  EXPECT_GT(all.first, two.first);
}

// What is kept has a bit each, in pairs of words of 64.
TEST_F(MaterialMeshOfFile, LeavesOutPartsOfMaterialsThatFillTheirLastWords) {
  int full = 0;
  for (unsigned seed = 0; full < 3; ++seed) {
    ASSERT_LT(seed, 1000U);
    MaterialVolume volume{{6, 5, 5}};
    volume.thresholds = {0};
    volume.edge = 1;
    volume.cube_size = 4;
    std::mt19937 random(seed);
    volume.fill([&](double, double, double) { return random() % 3 ? -1.0 : 1.0; });
    const std::string tag = encoded(volume);
    MaterialMeshOptions options = options_for(volume);
    options.keep = {"m1"};
    const std::int64_t all = mesh(tag, options).elements();
    if (all % 128 != 0) continue;
    ++full;
    options.parts = {true, 0};
    const Mesh kept = mesh(tag, options);
    check_surfaces(kept);
    const auto& quality = kept.result.quality.materials.at(0);
    EXPECT_EQ(quality.tetrahedra, kept.elements());
    EXPECT_EQ(quality.tetrahedra + quality.removed_tetrahedra, all);
    EXPECT_EQ(quality.parts, 1);
  }
}

TEST_F(MaterialMeshOfFile, PartsAreConnectedAcrossBricks) {
  // Noise, against the components by faces of the whole.
  std::mt19937 random(5);
  MaterialVolume volume{{40, 35, 38}};
  volume.edge = 1;
  volume.cube_size = 8;
  volume.fill([&](double, double, double) { return static_cast<double>(random() % 1000) / 1000; });
  volume.thresholds = {0.8F};
  MaterialMeshOptions options = options_for(volume);
  const Mesh mesh = this->mesh(encoded(volume), options);
  check_surfaces(mesh);
  std::vector<std::int64_t> parents(static_cast<std::size_t>(mesh.elements()));
  for (std::size_t i = 0; i < parents.size(); ++i) parents[i] = static_cast<std::int64_t>(i);
  const auto root = [&](std::int64_t e) {
    while (parents[static_cast<std::size_t>(e)] != e) e = parents[static_cast<std::size_t>(e)];
    return e;
  };
  std::map<std::set<std::int64_t>, std::int64_t> faces;
  for (std::int64_t e = 0; e < mesh.elements(); ++e)
    for (std::size_t corner = 0; corner < 4; ++corner) {
      std::set<std::int64_t> face;
      for (std::size_t i = 0; i < 4; ++i)
        if (i != corner) face.insert(mesh.node(e, i));
      const auto [other, is_new] = faces.emplace(face, e);
      if (is_new || mesh.material(other->second) != mesh.material(e)) continue;
      const std::int64_t a = root(e), b = root(other->second);
      parents[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    }
  std::map<std::string, std::int64_t> parts;
  for (std::int64_t e = 0; e < mesh.elements(); ++e) parts[mesh.material(e)] += root(e) == e;
  for (const auto& q : mesh.result.quality.materials) EXPECT_EQ(q.parts, parts[q.name]) << q.name;
}

TEST_F(MaterialMeshOfFile, OfLabels) {
  const Index3 dims{40, 44, 36};
  std::vector<std::uint8_t> labels;
  for_each_point_of(Box::of_size(dims), [&](Index3 p) {
    labels.push_back(p.x < 6 ? 0 : p.y < 20 ? 3 : p.z < 17 ? 7 : 200);
  });
  const std::string tag = encoded("l.tag", dims, labels, "spacings: 1 1 2\n", "uint8");
  MaterialMeshOptions options;
  options.labels = LabelsWish{{{3, "wood"}, {7, "steel"}, {200, "glass"}}, 1};
  options.fine = {2, ""};
  const Mesh mesh = this->mesh(tag, options);
  check_surfaces(mesh);
  ASSERT_EQ(mesh.mesh().materials.size(), 3U);
  EXPECT_EQ(mesh.mesh().materials[0].label, 3);
  EXPECT_EQ(mesh.mesh().materials[2].label, 200);
  // Samples are at the middles of voxels: planes are at 5.5, 19.5 and 2 * 16.5, the end at 38, 42 and 70.
  const auto& q = mesh.result.quality.materials;
  EXPECT_NEAR(q[0].volume, 32.5 * 19.5 * 70, 0.01 * q[0].volume);
  EXPECT_NEAR(q[1].volume, 32.5 * 22.5 * 33, 0.02 * q[1].volume);
  EXPECT_NEAR(q[2].volume, 32.5 * 22.5 * 37, 0.02 * q[2].volume);
  // Without names, all labels but 0.
  options.labels = LabelsWish{};
  const Mesh all = this->mesh(tag, options);
  ASSERT_EQ(all.mesh().materials.size(), 3U);
  EXPECT_EQ(all.mesh().materials[1].name, "label_7");
  EXPECT_TRUE(all.points == mesh.points && all.nodes == mesh.nodes);
}

// Sets a_b and c, and a and b_c, would have surfaces of one name.
TEST_F(MaterialMeshOfFile, HasSurfacesOfDifferentNames) {
  const Index3 dims{17, 17, 17};
  std::mt19937 random(2);
  std::vector<std::uint8_t> labels;
  for_each_point_of(Box::of_size(dims),
                    [&](Index3) { labels.push_back(static_cast<std::uint8_t>(random() % 6)); });
  MaterialMeshOptions options;
  options.labels = LabelsWish{{{1, "a"}, {2, "a_b"}, {3, "b_c"}, {4, "b_c_7"}, {5, "c"}}, 0};
  check_surfaces(mesh(encoded("l.tag", dims, labels, "", "uint8"), options));
}

// How many parts and surfaces there are is known only when the bricks are made. Here are 8,000 labels, and six times as
// many surfaces.
TEST_F(MaterialMeshOfFile, EndsBeforePartsAndSurfacesExceedTheLimitOnMemory) {
  const Index3 dims{40, 40, 40};
  std::vector<std::uint16_t> labels;
  for_each_point_of(Box::of_size(dims), [&](Index3 p) {
    labels.push_back(static_cast<std::uint16_t>(1 + p.x / 2 + 20 * (p.y / 2 + 20 * (p.z / 2))));
  });
  const TagBricks bricks(open_source(encoded("l.tag", dims, labels, "", "uint16")));
  MaterialMeshOptions options;
  options.labels = LabelsWish{{}, 0};
  const MaterialMeshJob job = settle_material_mesh(bricks, bricks.header().metadata.geometry(), options);
  const SpoolPlace place{path(""), "the mesh"};
  std::uint64_t peak = 0;
  // The number of surfaces.
  const auto made = [&](const PartsMemory& memory) {
    MeshAssembler assembler(job.settings, place, memory);
    MaterialBricks maker(bricks, job, layers_of(job), 1, {});
    for (std::size_t layer = 0; layer < maker.layers().size(); ++layer)
      maker.make(layer, [&](std::int64_t, const BrickMesh& brick) { assembler.add(brick); });
    MaterialMesh mesh{1, {}, "", {}, {}, place.file(), place.file(), place.file(), place.file()};
    const HeapPeak end;
    assembler.finish(job.names, {}, mesh);
    peak = end.bytes();
    return mesh.surfaces.size();
  };
  const auto work = [&](const PartsMemory& memory) -> std::string {
    try {
      made(memory);
    } catch (const MemoryLimit& error) {
      EXPECT_GT(error.needs().needed, memory.limit);
      return error.what();
    }
    return "";
  };
  const std::size_t surfaces = made({});
  EXPECT_GT(surfaces, 40000U);
  constexpr std::uint64_t bytes_of_surface = 1500, buffers = 16 << 20;
  if (!sanitized) {
    EXPECT_LE(peak, surfaces * bytes_of_surface + buffers);
    EXPECT_GT(3 * peak, surfaces * bytes_of_surface);
  }
  EXPECT_THAT(work({.limit = surfaces * bytes_of_surface}), testing::HasSubstr(" surfaces needs at least"));
  EXPECT_THAT(work({.limit = 1000}), testing::HasSubstr(" parts needs at least"));
  EXPECT_EQ(work({.limit = surfaces * bytes_of_surface + buffers}), "");
}

TEST_F(MaterialMeshOfFile, ValuesFarFromZeroKeepTheirPrecision) {
  MaterialVolume volume = balls();
  for (float& value : volume.values) value = std::round(value * 65536) / 65536;  // so that the sums are exact
  MaterialMeshOptions options = options_for(volume);
  const Mesh near = mesh(encoded(volume), options);
  std::vector<double> far;
  for (const float value : volume.values) far.push_back(static_cast<double>(value) + (1 << 30));
  for (MaterialRange& range : options.ranges) range.low += 1 << 30, range.high += 1 << 30;
  const Mesh other = mesh(encoded("far.tag", volume.dims, far, "spacings: 1 1.25 1\n", "double"), options);
  EXPECT_TRUE(near.points == other.points && near.nodes == other.nodes);
}

TEST_F(MaterialMeshOfFile, InfinitiesAreVeryLargeValues) {
  MaterialVolume volume{{21, 21, 21}};
  volume.thresholds = {0};
  volume.edge = 1;
  volume.fill([](double x, double y, double z) { return 7 - distance(x - 10, y - 10, z - 10); });
  const MaterialMeshOptions options = options_for(volume);
  const Mesh plain = mesh(encoded(volume), options);
  for (const float value : {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::max()}) {
    // They are inside, so the surface stays.
    volume.values[static_cast<std::size_t>(Box::of_size(volume.dims).offset({10, 10, 10}))] = value;
    volume.values[static_cast<std::size_t>(Box::of_size(volume.dims).offset({11, 10, 10}))] = value;
    const Mesh other = mesh(encoded(volume), options);
    EXPECT_TRUE(plain.points == other.points && plain.nodes == other.nodes) << value;
  }
}

TEST_F(MaterialMeshOfFile, IsMirroredLikeTheVolume) {
  MaterialVolume volume = balls();
  const std::string lines =
      "space: left-posterior-superior\nspace directions: (-1,0,0) (0,1.25,0) (0,0,1)\nspace origin: "
      "(7,8,9)\n";
  const Mesh mesh =
      this->mesh(encoded("v.tag", volume.dims, volume.values, lines, "float"), options_for(volume));
  check_surfaces(mesh);
  double most = -INFINITY;
  for (std::size_t i = 0; i < mesh.points.size(); i += 3) most = std::max(most, mesh.points[i]);
  EXPECT_EQ(most, 7);
  EXPECT_EQ(mesh.mesh().notes.space, "LPS");
}

TEST_F(MaterialMeshOfFile, IsTheSameForAnyNumberOfRanks) {
  MaterialVolume volume = balls();
  MaterialMeshRun run{encoded(volume), 0, path("alone.msh"), options_for(volume), Resources(1), {}};
  Ranks alone;
  write_material_mesh(alone, run).commit();
  run.output = path("ranks.msh");
  run.options.overwrite = true;
  for (const int count : {2, 3, 7}) {
    FakeRanks(count).run([&](Ranks& ranks) {
      if (ranks.rank() > 0) {
        serve(
            ranks, [](std::uint64_t) {}, [](const Bytes&) {});
        return;
      }
      write_material_mesh(ranks, run).commit();
      dismiss(ranks, 0);
    });
    EXPECT_TRUE(content("alone.msh") == content("ranks.msh")) << count;
  }
}

TEST_F(MaterialMeshOfFile, ARankThatFailsEndsIt) {
  MaterialVolume volume = balls();
  const std::string tag = encoded(volume);
  // A brick of the file is damaged: only the rank that reads it sees that.
  std::string bytes = content("v.tag");
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  file("v.tag", bytes);
  const MaterialMeshRun run{tag, 0, path("ranks.msh"), options_for(volume), Resources(1), {}};
  FakeRanks(3).run([&](Ranks& ranks) {
    if (ranks.rank() > 0) {
      serve(
          ranks, [](std::uint64_t) {}, [](const Bytes&) {});
      return;
    }
    EXPECT_THROW(write_material_mesh(ranks, run).commit(), BrokenInput);
    dismiss(ranks, 0);
  });
  EXPECT_EQ(names(), (std::vector<std::string>{"v.nrrd", "v.tag"}));
}

TEST_F(MaterialMeshOfFile, RefusesWhatItCannotMake) {
  MaterialVolume volume{{9, 9, 9}};
  volume.fill([](double x, double, double) { return x; });
  const std::string tag = encoded(volume);
  const auto message = [&](const std::function<void(MaterialMeshOptions&)>& change) -> std::string {
    MaterialMeshOptions options;
    options.ranges = {{"a", -INFINITY, 3}, {"b", 3, INFINITY}};
    change(options);
    try {
      mesh(tag, options);
    } catch (const UsageError& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_EQ(message([](auto&) {}), "no error");
  const std::vector<std::pair<std::function<void(MaterialMeshOptions&)>, std::string>> cases = {
      {[](auto& o) { o.ranges[1].low = 2; }, "b begins at 2, but another one ends at 3"},
      {[](auto& o) { o.ranges[1].high = 3; }, "b has no values"},
      {[](auto& o) { o.ranges[1].name = "a"; }, "two are called 'a'"},
      {[](auto& o) {
         o.ranges = {{"a", -INFINITY, INFINITY}};
       },
       "all values are of one material"},
      {[](auto& o) { o.keep = {"c"}; }, "no material is called 'c'"},
      {[](auto& o) {
         o.fine = {9, ""};
       },
       "choose a smaller size"},
      {[](auto& o) {
         o.fine = {0, ""};
       },
       "must be greater than 0"},
      {[](auto& o) {
         o.fine = {1, "mm"};
       },
       "does not state its unit"},
      {[](auto& o) {
         o.fine = {1, "furlong"};
       },
       "not a unit of length"},
      {[](auto& o) {
         o.fine = {2, ""}, o.coarse = {1, ""};
       },
       "must not be less"},
      {[](auto& o) {
         o.fine = {1e-9, ""};
       },
       "too fine"},
      {[](auto& o) { o.order = 3; }, "1 or 2"},
      {[](auto& o) { o.labels = LabelsWish{}; }, "labels must be integers"},
      {[](auto& o) { o.ranges[0].name = ""; }, "is not a name"},
      {[](auto& o) { o.ranges[1].low = NAN; }, "has no values from nan"},
      {[](auto& o) {
         o.ranges.clear();
         for (int i = 0; i < 70000; ++i) o.ranges.push_back({"m" + std::to_string(i), i * 1.0, i + 1.0});
       },
       "at most 65535"},
  };
  for (const auto& [change, wanted] : cases)
    EXPECT_NE(message(change).find(wanted), std::string::npos) << message(change) << " instead of " << wanted;
}

}  // namespace
}  // namespace tagrid
