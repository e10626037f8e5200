
#include <set>

#include "io/errors/errors.h"
#include "io/files/output_file.h"
#include "io/tag/bricks.h"
#include "stages/mesh/cut.h"
#include "tests/support/meshed_volume.h"
#include "tests/support/points.h"
#include "tests/support/runs.h"

namespace tagrid {
namespace {

class MeshFile : public MeshedVolume {
 protected:
  MeshFile() {
    options_.cube_size = 8;
    options_.brick_edge = 1;
    options_.mesh_error = 50;
  }

  // The points and six volumes of the tetrahedra of a volume with this header, in the world.
  void mesh_with(const std::string& fields, std::vector<double>& xyz, std::vector<double>& six) {
    const Index3& d = volume_.dims;
    const std::string header = "NRRD0004\ntype: int16\ndimension: 3\nsizes: " + std::to_string(d.x) + " " +
                               std::to_string(d.y) + " " + std::to_string(d.z) +
                               "\nencoding: raw\nendian: little\n" + fields + "\n";
    encode_volume(write_samples(volume_, header), {}, path("w.tag"), true, options_, Resources(2));
    write_mesh(path("w.tag"), path("w.vtu"), {{}, true, true}, Resources(2));
    Vtu vtu(path("w.vtu"));
    xyz = vtu.array<double>("Float64", "Points");
    const auto ids = vtu.array<std::int64_t>("Int64", "connectivity");
    six.clear();
    for (std::size_t t = 0; t < ids.size(); t += 4) {
      double e[3][3];
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t axis = 0; axis < 3; ++axis)
          e[i][axis] = xyz[3 * static_cast<std::size_t>(ids[t + i + 1]) + axis] -
                       xyz[3 * static_cast<std::size_t>(ids[t]) + axis];
      six.push_back(e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) -
                    e[0][1] * (e[1][0] * e[2][2] - e[1][2] * e[2][0]) +
                    e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0]));
    }
  }

  TestVolume volume_ = spiky_volume({11, 18, 9}, 3);
  EncodeOptions options_;
};

struct World {
  const char* fields;
  double axes[3][3];  // the step to the next sample, by axis
  double origin[3];
  double determinant;  // its absolute value
};

TEST_F(MeshFile, PointsLieWhereTheHeaderSaysAndVolumesArePositiveThere) {
  const World worlds[] = {
      {"spacings: 0.5 2 4\n", {{0.5, 0, 0}, {0, 2, 0}, {0, 0, 4}}, {0, 0, 0}, 4},
      {"space dimension: 3\nspace directions: (0.5,0,0) (0,2,0) (0,1,4)\nspace origin: (-3,1,8)\n",
       {{0.5, 0, 0}, {0, 2, 0}, {0, 1, 4}},
       {-3, 1, 8},
       4},
      {"space dimension: 3\nspace directions: (-0.5,0,0) (0,2,0) (0,1,4)\nspace origin: (-3,1,8)\n",
       {{-0.5, 0, 0}, {0, 2, 0}, {0, 1, 4}},
       {-3, 1, 8},
       4},
      {"space dimension: 3\nspace directions: (0,2,0) (0.5,0,0) (0,0,1)\n",
       {{0, 2, 0}, {0.5, 0, 0}, {0, 0, 1}},
       {0, 0, 0},
       1},
  };
  encode(volume_, options_);
  const ValuedMesh plain = mesh({}, true);
  for (const World& world : worlds) {
    SCOPED_TRACE(world.fields);
    std::vector<double> xyz, six;
    mesh_with(world.fields, xyz, six);
    ASSERT_EQ(xyz.size(), 3 * plain.points.size());
    for (std::size_t i = 0; i < plain.points.size(); ++i)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        double expected = world.origin[axis];
        for (int a = 0; a < 3; ++a)
          expected += static_cast<double>(plain.points[i][a] - 1) * world.axes[a][axis];
        ASSERT_EQ(xyz[3 * i + axis], expected);
      }
    ASSERT_EQ(six.size(), plain.size());
    for (std::size_t t = 0; t < six.size(); ++t)
      ASSERT_EQ(six[t], world.determinant * static_cast<double>(six_volumes(plain.vertices(t))));
  }
}

TEST_F(MeshFile, SameBytesForAnyThreadCount) {
  encode(volume_, options_);
  write_mesh(path("v.tag"), path("one.vtu"), {}, Resources(1));
  write_mesh(path("v.tag"), path("four.vtu"), {}, Resources(4));
  EXPECT_EQ(content("one.vtu"), content("four.vtu"));
}

TEST_F(MeshFile, AWrongCommandIsAUsageErrorAndLeavesNothing) {
  encode(volume_, options_);
  const auto before = names();
  for (const int level : {-1, 10, 1000})
    EXPECT_THROW(write_mesh(path("v.tag"), path("m.vtu"), {level, false, false}, Resources(1)), UsageError)
        << level;
  EXPECT_TRUE(has(message_of<UsageError>([&] { write_mesh(path("v.tag"), path("m.vtk"), {}, Resources(1)); }),
                  ".vtu"));
  EXPECT_EQ(names(), before);
  write_mesh(path("v.tag"), path("m.vtu"), {9, false, false}, Resources(1));
  EXPECT_THROW(write_mesh(path("v.tag"), path("m.vtu"), {}, Resources(1)), UsageError);
  EXPECT_NO_THROW(write_mesh(path("v.tag"), path("m.vtu"), {{}, false, true}, Resources(1)));
}

TEST_F(MeshFile, AVolumeOfOneSliceIsRefusedUnlessItIsPadded) {
  for (const Index3 dims : {Index3{11, 18, 1}, Index3{1, 18, 9}, Index3{11, 1, 9}}) {
    encode(spiky_volume(dims, 3), options_);
    const auto before = names();
    try {
      write_mesh(path("v.tag"), path("m.vtu"), {{}, false, true}, Resources(1));
      ADD_FAILURE();
    } catch (const UsageError& error) {
      EXPECT_EQ(error.detail().problem, Problem::mesh_fills_no_space) << error.what();
    }
    EXPECT_EQ(names(), before);
    EXPECT_NO_THROW(write_mesh(path("v.tag"), path("padded.vtu"), {{}, true, true}, Resources(1)));
  }
}

TEST_F(MeshFile, ATruncatedFileIsBrokenAndLeavesNothing) {
  encode(volume_, options_);
  const std::string whole = content("v.tag");
  for (const std::size_t size : {std::size_t{5}, whole.size() / 2, whole.size() - 1}) {
    file("cut.tag", whole.substr(0, size));
    const auto before = names();
    EXPECT_THROW(write_mesh(path("cut.tag"), path("m.vtu"), {}, Resources(2)), BrokenInput) << size;
    EXPECT_EQ(names(), before);
  }
}

// A file made from two others whose grids differ on the face between two layers: the mesh has cracks there,
// but every point has the value of its sample, which the layer below owns.
TEST_F(MeshFile, BricksThatDisagreeStillGetTheValuesOfTheirOwnSamples) {
  const TestVolume spiky = spiky_volume({8, 8, 16}, 5);
  const TestVolume flat{spiky.dims, std::vector<std::int16_t>(spiky.samples.size(), 123)};
  std::vector<BrickBytes> bricks;
  EncodeResult encoded;
  const TestVolume volumes[] = {flat, spiky};
  for (const TestVolume& volume : volumes) {
    encoded = encode(volume, options_);
    TagReader reader(path("v.tag"));
    for (BrickBytes brick; reader.read_brick(brick);)
      if (brick.id == (&volume == &volumes[0] ? 0 : 1)) bricks.push_back(brick);
  }
  ASSERT_EQ(bricks.size(), 2u);
  {
    OutputFile out(path("v.tag"), true);
    TagWriter writer(out, encoded.header);
    for (const BrickBytes& brick : bricks) writer.write_brick(brick, encoded.index.total);
    writer.finish();
    out.commit();
  }
  const TestVolume decoded = decode(spiky.dims);
  const ValuedMesh m = mesh({}, true);
  int on_face = 0;
  for (std::size_t i = 0; i < m.points.size(); ++i) {
    ASSERT_EQ(m.values[i], decoded.nearest(m.points[i] - Index3{1, 1, 1}));
    on_face += m.points[i].z == 8;
  }
  EXPECT_GT(on_face, 4);
}

// Volumes in ../shared/data, with all the points and tetrahedra of real grids.
class RealVolumes : public MeshedVolume {
 protected:
  void check(const std::string& name, Index3 dims, Index3 domain, bool grid_only) {
    const std::string samples = TAGRID_SOURCE_DIR "/../shared/data/" + name + ".raw";
    if (!std::filesystem::exists(samples)) GTEST_SKIP() << "no real volumes: " << samples << " is missing";
    EncodeOptions options{.grid_only = grid_only};
    RawDescription raw;  // without the header's spacing, so that points are lattice points
    raw.dims = dims;
    encode_volume(samples, SourceDescription(raw), path("v.tag"), true, options, Resources(2));
    for (const bool padded : {true, false}) {
      write_mesh(path("v.tag"), path("v.vtu"), {{}, padded, true}, Resources(2));
      Vtu vtu(path("v.vtu"));
      const Index3 first{1, 1, 1};
      const LatticeMesh m = read_lattice_mesh(vtu, first);
      const Box box = padded ? Box{{0, 0, 0}, domain} : Box{first, dims};
      const Index3 edges = box.high - box.low;
      std::int64_t inner_open_faces = 0;
      const auto open_face = [&](const std::array<std::size_t, 3>& face) {
        inner_open_faces += !is_on_border({m.points[face[0]], m.points[face[1]], m.points[face[2]]}, box);
      };
      const MeshFindings found = check_mesh(m, open_face, padded ? std::nullopt : std::optional(box));
      EXPECT_TRUE(found.good()) << found.text();
      EXPECT_GT(m.size(), 1000u);
      EXPECT_EQ(found.six_volumes, 6 * edges.x * edges.y * edges.z);
      EXPECT_EQ(inner_open_faces, 0);
    }
  }
};

TEST_F(RealVolumes, TheMeshOfTheLobsterIsConforming) {
  check("lobster", {301, 324, 56}, {320, 352, 64}, true);
}
TEST_F(RealVolumes, TheMeshOfTheEngineIsConforming) {
  check("engine", {256, 256, 128}, {256, 256, 128}, false);
}

// A region of the mesh: the tetrahedra of the whole mesh that meet it, from the bricks around it.

/// Tetrahedra as the places and values of their vertices, and their levels, sorted.
using SortedMesh = std::vector<std::pair<std::array<std::array<std::int64_t, 4>, 4>, int>>;

// A tetrahedron of the hierarchy and a box of samples meet in a polytope whose corners are samples.
bool meets_in_a_sample(const std::array<Index3, 4>& v, const Box& box) {
  for (const auto [x, y, z] : points_of(box)) {
    bool within = true;
    const bool positive = six_volumes(v) > 0;
    for (std::size_t i = 0; i < 4 && within; ++i) {
      auto other = v;
      other[i] = {x, y, z};
      within = positive ? six_volumes(other) >= 0 : six_volumes(other) <= 0;
    }
    if (within) return true;
  }
  return false;
}

class MeshRegion : public MeshedVolume {
 protected:
  static WantedRegion region(const Box& box) {
    WantedRegion wanted;
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      wanted.low[a] = box.low[axis];
      wanted.high[a] = box.high[axis] + 1;
    }
    return wanted;
  }

  ValuedMesh read(const std::string& name) const {
    Vtu vtu(path(name));
    // Padding begins one step before the first sample.
    const Index3 first{1, 1, 1};
    ValuedMesh m{read_lattice_mesh(vtu, first), vtu.array<std::int16_t>("Int16", "value")};
    for (Index3& p : m.points) p = p - first;
    std::set<std::array<std::int64_t, 3>> points;
    for (const Index3& p : m.points)
      EXPECT_TRUE(points.insert({p.x, p.y, p.z}).second) << "a point is there twice";
    return m;
  }

  static SortedMesh those_that_meet(const ValuedMesh& mesh, const Box& box) {
    SortedMesh sorted;
    for (std::size_t t = 0; t < mesh.size(); ++t) {
      if (!meets(mesh.vertices(t), box)) continue;
      std::array<std::array<std::int64_t, 4>, 4> vertices;
      for (std::size_t v = 0; v < 4; ++v) {
        const auto i = static_cast<std::size_t>(mesh.connectivity[4 * t + v]);
        vertices[v] = {mesh.points[i].x, mesh.points[i].y, mesh.points[i].z, mesh.values[i]};
      }
      sorted.emplace_back(vertices, mesh.levels[t]);
    }
    std::sort(sorted.begin(), sorted.end());
    return sorted;
  }

  std::vector<Box> boxes(Index3 dims) {
    std::vector<Box> some = {Box::of_size(dims),
                             {{8, 8, 8}, {8, 8, 8}},  // a corner of bricks
                             {dims - Index3{1, 1, 1}, dims - Index3{1, 1, 1}},
                             {{0, 3, 0}, {dims.x - 1, 3, dims.z - 1}}};
    for (int i = 0; i < 4; ++i) {
      Box box;
      for (int axis = 0; axis < 3; ++axis) {
        const auto n = static_cast<std::uint64_t>(dims[axis]);
        const auto a = static_cast<std::int64_t>(random_() % n), b = static_cast<std::int64_t>(random_() % n);
        box.low[axis] = std::min(a, b);
        box.high[axis] = std::max(a, b);
      }
      some.push_back(box);
    }
    return some;
  }

  void check(const EncodeOptions& options) {
    const Index3 dims{21, 18, 19};
    encode(spiky_volume(dims, 5), options);
    int i = 0;
    for (const std::optional<int> level : {std::optional<int>(), std::optional(4)})
      for (const bool padded : {false, true}) {
        write_mesh(path("v.tag"), path("all.vtu"), {level, padded, true}, Resources(2));
        const ValuedMesh all = read("all.vtu");
        for (const Box& box : boxes(dims)) {
          const MeshResult result =
              write_mesh(path("v.tag"), path("part.vtu"), {level, padded, true, {}, region(box)},
                         Resources(1 + i++ % 3));
          const ValuedMesh part = read("part.vtu");
          EXPECT_EQ(result.tetrahedra, static_cast<std::int64_t>(part.size()));
          const std::set<std::int64_t> used(part.connectivity.begin(), part.connectivity.end());
          EXPECT_EQ(used.size(), part.points.size()) << "every point is one of a tetrahedron";
          const SortedMesh expected = those_that_meet(all, box);
          EXPECT_FALSE(expected.empty());
          // The faces of cut pieces have other directions.
          for (std::size_t t = 0; t < all.size(); ++t) {
            const bool met = meets(all.vertices(t), box);
            ASSERT_TRUE(met == meets_in_a_sample(all.vertices(t), box) || (met && !padded));
          }
          EXPECT_EQ(those_that_meet(part, Box{{-100, -100, -100}, {200, 200, 200}}), expected);
        }
      }
  }

  std::mt19937_64 random_{7};
};

const EncodeOptions small_bricks{.cube_size = 8, .brick_edge = 1};

TEST_F(MeshRegion, HasTheTetrahedraOfTheWholeMeshThatMeetIt) {
  check(small_bricks);
  check({.grid_only = true, .cube_size = 8, .brick_edge = 1});
  check({.grid = GridOrigin::derived, .cube_size = 8, .brick_edge = 1});
}

TEST_F(MeshRegion, NeedsOnlyTheBricksAroundIt) {
  const Index3 dims{40, 16, 16};
  encode(spiky_volume(dims, 5), small_bricks);
  const WantedRegion far = region({{33, 2, 2}, {38, 5, 5}}), near = region({{1, 1, 1}, {3, 3, 3}});
  write_mesh(path("v.tag"), path("before.vtu"), {{}, false, true, {}, far}, Resources(2));
  // The first byte of the first brick.
  std::string bytes = content("v.tag");
  {
    const TagBricks file(std::make_shared<FileSource>(path("v.tag")));
    bytes[bytes.find(std::string(reinterpret_cast<const char*>(file.read(0).values.data()), 16))] ^= 1;
  }
  file("v.tag", bytes);
  write_mesh(path("v.tag"), path("after.vtu"), {{}, false, true, {}, far}, Resources(2));
  EXPECT_EQ(content("after.vtu"), content("before.vtu"));
  EXPECT_THROW(write_mesh(path("v.tag"), path("x.vtu"), {{}, false, true, {}, near}, Resources(2)),
               BrokenInput);
}

TEST_F(MeshRegion, OutsideOfTheVolumeIsRefused) {
  const Index3 dims{21, 18, 19};
  encode(spiky_volume(dims, 5), small_bricks);
  const auto before = names();
  for (const Box& box : {Box{{0, 0, 0}, {21, 1, 1}}, Box{{-1, 0, 0}, {1, 1, 1}}, Box{{3, 3, 3}, {3, 2, 3}},
                         Box{{30, 30, 30}, {31, 31, 31}}})
    for (const bool padded : {false, true})
      EXPECT_THROW(
          write_mesh(path("v.tag"), path("x.vtu"), {{}, padded, true, {}, region(box)}, Resources(1)),
          UsageError);
  EXPECT_EQ(names(), before);
}

}  // namespace
}  // namespace tagrid
