
#include <set>

#include "io/errors/errors.h"
#include "pipeline/meshes/surface.h"
#include "stages/grid/lattice.h"
#include "tests/support/meshed_volume.h"
#include "tests/support/ply_reader.h"
#include "tests/support/runs.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

class Surfaces : public MeshedVolume {
 protected:
  PlySurface surface(const SurfaceOptions& options, int threads = 2) {
    SurfaceOptions with = options;
    with.overwrite = true;
    last_ = write_surface(path("v.tag"), path("v.ply"), with, Resources(threads));
    PlySurface read = read_ply(content("v.ply"));
    EXPECT_EQ(last_.counts.vertices, static_cast<std::int64_t>(read.vertices.size()));
    EXPECT_EQ(last_.counts.triangles, static_cast<std::int64_t>(read.triangles.size()));
    EXPECT_EQ(last_.bytes_out, content("v.ply").size());
    return read;
  }
  static SurfaceFindings check(const PlySurface& s) { return check_surface(s.vertices.size(), s.triangles); }

  SurfaceResult last_;
};

// Values from 0 to 3: a quarter of them is equal to each whole number.
TestVolume stepped_volume(Index3 dims, std::uint64_t seed) {
  TestVolume volume{dims, {}};
  std::mt19937_64 random(seed);
  for (std::int64_t i = 0; i < Box::of_size(dims).count(); ++i)
    volume.samples.push_back(static_cast<std::int16_t>(random() % 4));
  return volume;
}

using Place = std::array<double, 3>;

// Marches the mesh that `mesh` writes: the places of the vertices, and the number of triangles.
std::pair<std::set<Place>, std::size_t> march(const ValuedMesh& mesh, double iso) {
  std::map<std::pair<std::int64_t, std::int64_t>, Place> vertices;
  std::size_t triangles = 0;
  for (std::size_t t = 0; t < mesh.size(); ++t) {
    int crossed = 0;
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = 0; j < i; ++j) {
        auto a = static_cast<std::size_t>(mesh.ids(t)[i]), b = static_cast<std::size_t>(mesh.ids(t)[j]);
        if ((mesh.values[a] >= iso) == (mesh.values[b] >= iso)) continue;
        ++crossed;
        const auto raster = [&](std::size_t p) {
          return std::array{mesh.points[p].z, mesh.points[p].y, mesh.points[p].x};
        };
        if (raster(b) < raster(a)) std::swap(a, b);
        const double at = (iso - mesh.values[a]) / (static_cast<double>(mesh.values[b]) - mesh.values[a]);
        Place place;
        for (int axis = 0; axis < 3; ++axis) {
          // Sample i is the lattice point i + 1.
          const auto from = static_cast<double>(mesh.points[a][axis] - 1);
          place[static_cast<std::size_t>(axis)] =
              from + at * (static_cast<double>(mesh.points[b][axis] - 1) - from);
        }
        vertices[{static_cast<std::int64_t>(a), static_cast<std::int64_t>(b)}] = place;
      }
    triangles += crossed == 4 ? 2 : crossed == 3 ? 1 : 0;
  }
  std::set<Place> places;
  for (const auto& [edge, place] : vertices) places.insert(place);
  return {places, triangles};
}

struct SurfaceCase {
  Index3 dims;
  int cube_size, brick_edge;
  bool grid_only, derived, phantom;
};

std::ostream& operator<<(std::ostream& out, const SurfaceCase& c) {
  return out << c.dims.x << "x" << c.dims.y << "x" << c.dims.z << " S " << c.cube_size << " brick "
             << c.brick_edge
             << (c.grid_only ? " grid"
                 : c.derived ? " derived"
                             : " voxels")
             << (c.phantom ? " phantom" : " spikes");
}

std::vector<SurfaceCase> surface_cases() {
  std::vector<SurfaceCase> cases;
  int i = 0;
  for (const Index3 dims :
       {Index3{2, 19, 3}, {9, 9, 9}, {13, 17, 18}, {21, 6, 25}, {33, 12, 7}, {2, 2, 2}, {14, 15, 30}})
    for (const int cube : {4, 8})
      for (const int brick : {1, 2, 4}) {
        if (!sanitized || i % 4 == 0)
          cases.push_back({dims, cube, brick, i % 3 == 0, i % 3 == 1, i % 2 == 0});
        ++i;
      }
  return cases;
}

class SurfaceOfMesh : public Surfaces, public ::testing::WithParamInterface<SurfaceCase> {
 protected:
  SurfaceOfMesh() {
    const SurfaceCase& c = GetParam();
    const auto seed = static_cast<std::uint64_t>(c.dims.x + 100 * c.dims.y);
    EncodeOptions options{
        .grid_only = c.grid_only, .max_error = 9, .cube_size = c.cube_size, .brick_edge = c.brick_edge};
    if (c.derived) options.grid = GridOrigin::derived;
    encode(c.phantom ? phantom_volume(c.dims, seed) : spiky_volume(c.dims, seed), options);
  }
};

TEST_P(SurfaceOfMesh, HasTheVerticesAndTrianglesOfTheMeshAtEveryLevel) {
  for (int level = 0; level <= max_level(GetParam().cube_size); ++level)
    for (const double iso : {-700.5, -700.0, 20.5}) {
      SCOPED_TRACE(::testing::Message() << "level " << level << ", iso " << iso);
      const PlySurface s = surface({.iso = iso, .level = level});
      // The mesh does not say which of its vertices that have just the value are alone.
      if (iso != -700) {
        const auto [places, triangles] = march(mesh(level, false), iso);
        EXPECT_EQ(std::set<Place>(s.vertices.begin(), s.vertices.end()), places);
        EXPECT_EQ(s.triangles.size(), triangles);
      }
      const SurfaceFindings found = check(s);
      EXPECT_TRUE(found.good()) << found.text();
      EXPECT_EQ(last_.boundary_edges, found.border_edges);
      const SurfaceFindings closed = check(surface({.iso = iso, .level = level, .close = true}));
      EXPECT_TRUE(closed.good()) << closed.text();
      EXPECT_EQ(closed.border_edges, 0);
      EXPECT_EQ(last_.boundary_edges, 0);
    }
}

INSTANTIATE_TEST_SUITE_P(All, SurfaceOfMesh, ::testing::ValuesIn(surface_cases()));

TEST_F(Surfaces, AreTheSameForAnyBricksAndThreads) {
  for (const bool close : {false, true}) {
    std::optional<SurfaceFindings> first;
    std::set<Place> places;
    for (const int brick : {1, 2, 4}) {
      EncodeOptions options{.cube_size = 8, .brick_edge = brick};
      encode(stepped_volume({37, 21, 29}, 5), options);
      const PlySurface s = surface({.iso = 2, .close = close}, 1);
      const std::string bytes = content("v.ply");
      for (const int threads : {2, 5}) {
        surface({.iso = 2, .close = close}, threads);
        EXPECT_TRUE(content("v.ply") == bytes) << threads;
      }
      const SurfaceFindings found = check(s);
      EXPECT_TRUE(found.good()) << found.text();
      if (!first) {
        first = found;
        places = {s.vertices.begin(), s.vertices.end()};
      }
      EXPECT_EQ(found.vertices, first->vertices);
      EXPECT_EQ(found.triangles, first->triangles);
      EXPECT_EQ(found.components, first->components);
      EXPECT_EQ(found.euler(), first->euler());
      EXPECT_EQ(found.border_edges, first->border_edges);
      EXPECT_TRUE(std::set<Place>(s.vertices.begin(), s.vertices.end()) == places) << brick;
    }
  }
}

TEST_F(Surfaces, OfARegionHaveTheTrianglesOfItsTetrahedra) {
  EncodeOptions options{.cube_size = 8, .brick_edge = 1};
  for (const bool derived : {false, true}) {
    options.grid = derived ? GridOrigin::derived : GridOrigin::stored;
    encode(phantom_volume({37, 31, 29}, 5), options);
    const PlySurface all = surface({.iso = 20.5});
    WantedRegion region;
    region.low = {9, 3, std::nullopt};
    region.high = {18, 22, 12};
    const PlySurface some = surface({.iso = 20.5, .region = region});
    EXPECT_FALSE(last_.boundary_edges.has_value());
    const auto triangles_of = [](const PlySurface& s) {
      std::multiset<std::array<Place, 3>> set;
      for (const auto& t : s.triangles)
        set.insert({s.vertices[static_cast<std::size_t>(t[0])], s.vertices[static_cast<std::size_t>(t[1])],
                    s.vertices[static_cast<std::size_t>(t[2])]});
      return set;
    };
    const auto of_all = triangles_of(all), of_some = triangles_of(some);
    EXPECT_GT(of_some.size(), 10U);
    EXPECT_LT(of_some.size(), of_all.size());
    EXPECT_TRUE(std::includes(of_all.begin(), of_all.end(), of_some.begin(), of_some.end()));
    EXPECT_EQ(std::set<Place>(some.vertices.begin(), some.vertices.end()).size(), some.vertices.size())
        << "each vertex exists once";
    const SurfaceFindings found = check(some);
    EXPECT_EQ(found.crowded + found.unused + found.collapsed, 0) << found.text();
  }
}

TEST_F(Surfaces, AWrongCommandIsAUsageErrorAndLeavesNothing) {
  EncodeOptions options{.cube_size = 8};
  encode(stepped_volume({9, 9, 9}, 5), options);
  const auto before = names();
  const auto refused = [&](const SurfaceOptions& wrong, const std::string& output) {
    EXPECT_THROW(write_surface(path("v.tag"), path(output), wrong, Resources(1)), UsageError);
    EXPECT_EQ(names(), before);
  };
  refused({.iso = 1, .level = 10}, "x.ply");
  refused({.iso = 1, .level = -1}, "x.ply");
  refused({.iso = 1}, "x.vtu");
  WantedRegion outside;
  outside.high[0] = 10;
  refused({.iso = 1, .region = outside}, "x.ply");
  for (const Index3 dims : {Index3{9, 9, 1}, {1, 9, 9}, {9, 1, 1}}) {
    encode(stepped_volume(dims, 5), options);
    refused({.iso = 1}, "x.ply");
  }
}

TEST_F(Surfaces, ATruncatedFileIsBrokenAndLeavesNothing) {
  EncodeOptions options{.cube_size = 8};
  encode(stepped_volume({20, 9, 9}, 5), options);
  const std::string whole = content("v.tag");
  for (const std::size_t size : {std::size_t{5}, whole.size() / 2, whole.size() - 1}) {
    file("cut.tag", whole.substr(0, size));
    const auto before = names();
    EXPECT_THROW(write_surface(path("cut.tag"), path("x.ply"), {.iso = 1}, Resources(2)), BrokenInput);
    EXPECT_EQ(names(), before);
  }
}

// Real volumes in ../shared/data.
TEST_F(Surfaces, OfTheLobsterAreManifoldsForAnyBricks) {
  const std::string samples = TAGRID_SOURCE_DIR "/../shared/data/lobster.raw";
  if (!std::filesystem::exists(samples)) GTEST_SKIP() << "no real volumes: " << samples << " is missing";
  RawDescription raw;
  raw.dims = {301, 324, 56};
  std::optional<SurfaceFindings> first[2];
  for (const int brick : {1, 2, 4}) {
    EncodeOptions options{.brick_edge = brick};
    encode_volume(samples, SourceDescription(raw), path("v.tag"), true, options, Resources(2));
    for (const bool close : {false, true}) {
      const SurfaceFindings found = check(surface({.iso = 60, .close = close}));
      EXPECT_TRUE(found.good()) << found.text();
      EXPECT_EQ(last_.boundary_edges, found.border_edges);
      auto& expected = first[close ? 1 : 0];
      if (!expected) expected = found;
      EXPECT_EQ(found.vertices, expected->vertices);
      EXPECT_EQ(found.triangles, expected->triangles);
      EXPECT_EQ(found.components, expected->components);
      EXPECT_EQ(found.euler(), expected->euler());
    }
  }
  EXPECT_GT(first[0]->triangles, 100000);
}

// Where surfaces lie in the world, which way they face, and what a value means.

using Place = std::array<double, 3>;

// Six times the volume that a closed surface encloses.
double six_volumes_in(const PlySurface& s) {
  double sum = 0;
  for (const auto& t : s.triangles) {
    const Place &a = s.vertices[static_cast<std::size_t>(t[0])],
                &b = s.vertices[static_cast<std::size_t>(t[1])],
                &c = s.vertices[static_cast<std::size_t>(t[2])];
    sum += a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
           a[2] * (b[0] * c[1] - b[1] * c[0]);
  }
  return sum;
}

class SurfaceInWorld : public TemporaryFolder {
 protected:
  // A ramp along x from 0 to 16, encoded with these header lines. Its root cubes meet at 7 and 15, and the one
  // in the middle has no vertex in padding: there the field is the ramp.
  PlySurface ramp(const std::string& fields, SurfaceOptions options) {
    const Index3 dims{17, 5, 5};
    std::vector<std::int16_t> samples;
    for (std::int64_t i = 0; i < Box::of_size(dims).count(); ++i)
      samples.push_back(static_cast<std::int16_t>(i % 17));
    write_nrrd(path("in.nrrd"), dims, samples, fields);
    EncodeOptions encoding{.cube_size = 8};
    encode_volume(path("in.nrrd"), {}, path("in.tag"), true, encoding, Resources(1));
    options.overwrite = true;
    last_ = write_surface(path("in.tag"), path("out.ply"), options, Resources(1));
    return read_ply(content("out.ply"));
  }
  SurfaceResult last_;
};

TEST_F(SurfaceInWorld, VerticesLieWhereTheHeaderSaysAndNormalsPointTowardsLowerValues) {
  for (const double x : {-0.5, 0.5}) {
    const std::string fields = "space dimension: 3\nspace directions: (" + std::to_string(x) +
                               ",0,0) (0,2,0) (0,1,4)\nspace origin: (-3,1,8)\n";
    const PlySurface s = ramp(fields, {.iso = 9.25, .area = true});
    ASSERT_FALSE(s.vertices.empty());
    for (const Place& p : s.vertices) EXPECT_EQ(p[0], -3 + 9.25 * x);
    EXPECT_NEAR(last_.counts.area, 4 * 2 * 4 * 4, 1e-9) << "4 x 4 parallelograms of 2 along y and 4 across";
    double area_along_x = 0;
    for (const auto& t : s.triangles) {
      const Place &a = s.vertices[static_cast<std::size_t>(t[0])],
                  &b = s.vertices[static_cast<std::size_t>(t[1])],
                  &c = s.vertices[static_cast<std::size_t>(t[2])];
      area_along_x += ((b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1])) / 2;
    }
    EXPECT_NEAR(area_along_x, x > 0 ? -128 : 128, 1e-9) << "values rise with x in the volume";
    const PlySurface closed = ramp(fields, {.iso = 9.25, .close = true});
    EXPECT_NEAR(six_volumes_in(closed) / 6, (16 - 9.25) * 4 * 4 * 0.5 * 2 * 4, 1e-9);
  }
}

TEST_F(SurfaceInWorld, AxesOfDifferentUnitsBecomeOnesOfTheFirstUnit) {
  double most = 0;
  for (const Place& p : ramp("spacings: 0.5 2 3000\nunits: \"mm\" \"mm\" \"um\"\n", {.iso = 9.25}).vertices) {
    EXPECT_EQ(p[0], 9.25 * 0.5);
    most = std::max(most, p[2]);
  }
  EXPECT_EQ(most, 4 * 3);
}

TEST_F(SurfaceInWorld, TheValueIsInTheUnitsThatTheFileGives) {
  for (const Place& p : ramp("rescale_slope:=0.5\nrescale_intercept:=-10\n", {.iso = -5.5}).vertices)
    EXPECT_EQ(p[0], 9);
  // With a negative slope values fall along x; what is at least the value is at low x.
  const PlySurface s = ramp("rescale_slope:=-2\nrescale_intercept:=1\n", {.iso = -17, .close = true});
  double least = 1e9;
  for (const Place& p : s.vertices) {
    least = std::min(least, p[0]);
    EXPECT_LE(p[0], 9);
  }
  EXPECT_EQ(least, 0);
  EXPECT_NEAR(six_volumes_in(s) / 6, 9 * 4 * 4, 1e-9);
  EXPECT_THROW(ramp("slice_slopes:=1 2 3 4 5\n", {.iso = 3}), UsageError);
  EXPECT_THROW(ramp("rescale_slope:=0\n", {.iso = 3}), BrokenInput);
}

}  // namespace
}  // namespace tagrid
