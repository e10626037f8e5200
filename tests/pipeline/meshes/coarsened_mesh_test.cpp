// The promise of a coarsened mesh, checked in the written mesh: every decoded voxel is searched for in its tetrahedra.
#include <set>

#include "io/errors/errors.h"
#include "tests/support/awkward_volumes.h"
#include "tests/support/coarsest_grid.h"
#include "tests/support/mesh_field.h"
#include "tests/support/runs.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

struct CoarsenedFile {
  bool grid_only = false, derived = false;
  std::optional<double> max_error = {};
};

// Lossless, with a loss, without a grid, and with nothing but a grid.
const CoarsenedFile coarsened_files[] = {{},     {false, false, 3.0}, {false, true, 2.0}, {true, false, 4.0},
                                         {true}, {false, true}};

class CoarsenedFolder : public TemporaryFolder {
 protected:
  template <class T>
  void encode(const std::vector<T>& samples, Index3 dims, const CoarsenedFile& file, int cube_size,
              int brick_edge) {
    EncodeOptions options{.grid_only = file.grid_only,
                          .grid = file.derived ? GridOrigin::derived : GridOrigin::stored,
                          .max_error = file.max_error,
                          .cube_size = cube_size,
                          .brick_edge = brick_edge,
                          .lead = lead_};
    write_nrrd(in_, dims, samples);
    encode_volume(in_, {}, tag_, true, options, Resources(2));
  }
  template <class T>
  std::vector<T> decoded() const {
    decode_volume(tag_, path("out.nrrd"), format_named("nrrd"), true, Resources(2));
    return read_samples<T>(path("out.nrrd"));
  }
  MeshResult coarsen(double bound, bool padded, const Resources& resources = Resources(2)) const {
    return write_mesh(tag_, vtu_, {{}, padded, true, bound}, resources);
  }

  int lead_ = 1;
  const std::string in_ = path("in.nrrd"), tag_ = path("a.tag"), vtu_ = path("a.vtu");
};

template <class T>
class CoarsenedMesh : public CoarsenedFolder {
 protected:
  // Samples that are not finite must be points of the mesh; all others must be within the bound of its field.
  void expect_promise(const std::vector<T>& samples, Index3 dims, double bound, bool padded) {
    Vtu vtu(vtu_);
    const Domain domain{dims, 4, this->lead_};
    const LatticeMesh mesh = read_lattice_mesh(vtu, domain.first());
    const std::vector<T> values = vtu.array<T>(vtk_type<T>(), "value");
    const Box box = domain.volume();
    std::vector<bool> seen(samples.size());
    std::int64_t beyond = 0;
    for_each_point_in_mesh(mesh, box, [&](Index3 p, std::size_t t, const auto& weights, std::int64_t six) {
      const auto at = static_cast<std::size_t>(box.offset(p));
      seen[at] = true;
      long double sum = 0;
      for (std::size_t i = 0; i < 4; ++i)
        if (weights[i] != 0)
          sum += static_cast<long double>(weights[i]) *
                 static_cast<long double>(values[static_cast<std::size_t>(mesh.ids(t)[i])]);
      const long double whole = six, sample = samples[at];
      const bool vertex = *std::max_element(weights.begin(), weights.end()) == six;
      if (!std::isfinite(sample))
        beyond += !vertex;
      else
        beyond += !(std::fabs(sum - whole * sample) <= whole * static_cast<long double>(bound));
    });
    EXPECT_EQ(beyond, 0) << "samples are too far from the mesh";
    EXPECT_TRUE(std::all_of(seen.begin(), seen.end(), [](bool b) { return b; })) << "the mesh has holes";
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
      if (const Index3 p = mesh.points[i]; bound == 0 && box.contains(p)) {
        ASSERT_TRUE(comes_back(samples[static_cast<std::size_t>(box.offset(p))], values[i], 0));
      }
    const MeshFindings found = padded ? check_mesh(mesh, [](const auto&) {})
                                      : check_mesh(
                                            mesh, [](const auto&) {}, box);
    EXPECT_TRUE(found.good()) << found.text();
  }
};

TYPED_TEST_SUITE(CoarsenedMesh, AllTypes);

TYPED_TEST(CoarsenedMesh, IsWithinTheBoundOfEveryDecodedVoxel) {
  unsigned seed = 0;
  for (const Index3 dims :
       {Index3{9, 9, 9}, {13, 10, 19}, {2, 2, 2}, {2, 5, 70}, {33, 12, 7}, {1, 9, 4}, {1, 1, 1}})
    for (const CoarsenedFile& file : coarsened_files) {
      if (++seed % 5 != 0 && sanitized) continue;
      const int cube_size = seed % 3 == 0 ? 32 : seed % 2 ? 8 : 4;
      const bool padded = seed % 4 == 0 || std::min({dims.x, dims.y, dims.z}) == 1;
      const auto samples =
          seed % 2 ? blobs<TypeParam>(dims, seed) : awkward_volume<TypeParam>(Awkward::noise, dims, seed);
      this->lead_ = seed / 2 % 2;
      this->encode(samples, dims, file, cube_size, 1 + seed % 2);
      const std::vector<TypeParam> decoded = this->template decoded<TypeParam>();
      for (const double bound : {seed % 6 < 3 ? 0.0 : 0.75, seed % 2 ? 4.0 : 25.0}) {
        SCOPED_TRACE(::testing::Message() << dims.x << "x" << dims.y << "x" << dims.z << ", S " << cube_size
                                          << ", E " << bound << ", file " << &file - coarsened_files);
        this->coarsen(bound, padded);
        this->expect_promise(decoded, dims, bound, padded);
        if (this->HasFailure()) return;
      }
    }
}

TYPED_TEST(CoarsenedMesh, HoldsOnAwkwardVolumes) {
  for (int kind = 0; kind < static_cast<int>(Awkward::count); ++kind)
    for (const bool padded : {false, true}) {
      SCOPED_TRACE(name_of(Awkward(kind)));
      const Index3 dims{11, 14, 10};
      const auto samples = awkward_volume<TypeParam>(Awkward(kind), dims, 3);
      this->encode(samples, dims, {}, 8, 1);
      for (const double bound : {0.0, 5.0}) {
        this->coarsen(bound, padded);
        this->expect_promise(samples, dims, bound, padded);
      }
      if (this->HasFailure()) return;
    }
}

class CoarsenedBricks : public CoarsenedFolder {
 protected:
  using Cell = std::array<std::array<std::int64_t, 3>, 4>;
  static Cell sorted(const std::array<Index3, 4>& vertices) {
    Cell cell;
    for (std::size_t i = 0; i < 4; ++i) cell[i] = {vertices[i].x, vertices[i].y, vertices[i].z};
    std::sort(cell.begin(), cell.end());
    return cell;
  }
  std::set<Cell> cells() const {
    Vtu vtu(vtu_);
    const LatticeMesh mesh = read_lattice_mesh(vtu, {lead_, lead_, lead_});
    std::set<Cell> all;
    for (std::size_t t = 0; t < mesh.size(); ++t) all.insert(sorted(mesh.vertices(t)));
    EXPECT_EQ(all.size(), mesh.size());
    return all;
  }
  static std::set<Cell> cells_of(const LatticeBits& grid, int cube_size, const Box& samples, bool padded) {
    std::set<Cell> all;
    for_each_leaf_tetrahedron(grid, grid.box(), cube_size, max_level(cube_size), [&](const Tetrahedron& t) {
      if (padded || !reaches_beyond(t.vertices, samples)) {
        all.insert(sorted(t.vertices));
        return;
      }
      for (const auto& piece : cut_at(t.vertices, samples)) all.insert(sorted(piece));
    });
    return all;
  }
};

TEST_F(CoarsenedBricks, AreThoseOfTheOracleForEverySizeOfBricks) {
  for (unsigned seed = 1; seed < 4; ++seed) {
    const Index3 dims{22, 11, 27};
    const auto samples = blobs<std::int16_t>(dims, seed, 3);
    lead_ = seed > 1;
    const oracle::Volume<std::int16_t> volume{dims, samples, lead_};
    const int cube_size = seed % 2 ? 4 : 8;
    const double bound = 2.5 * seed;
    std::set<Cell> expected[2];
    for (const bool padded : {false, true})
      expected[padded] =
          cells_of(oracle::coarsest_grid(volume, cube_size, bound, padded), cube_size, volume.box(), padded);
    for (const int brick_edge : {1, 2, 3, 9}) {
      encode(samples, dims, {}, cube_size, brick_edge);
      for (const bool padded : {false, true}) {
        coarsen(bound, padded, Resources(brick_edge));
        ASSERT_TRUE(cells() == expected[padded])
            << "seed " << seed << ", brick " << brick_edge << ", " << padded;
      }
    }
  }
}

TEST_F(CoarsenedBricks, OneSpikeIsFollowedThroughAllBricks) {
  const Index3 dims{41, 41, 41};
  std::vector<std::int16_t> samples(41 * 41 * 41, 0);
  const Box box = Box::of_size(dims);
  // At a corner of bricks, and inside of one.
  for (const Index3 spike : {Index3{16, 16, 16}, {21, 19, 18}, {0, 40, 8}}) {
    samples.assign(samples.size(), 0);
    samples[static_cast<std::size_t>(box.offset(spike))] = 100;
    for (const int brick_edge : {1, 2}) {
      encode(samples, dims, {}, 8, brick_edge);
      coarsen(7, true);
      const oracle::Volume<std::int16_t> volume{dims, samples, lead_};
      const LatticeBits grid = oracle::coarsest_grid(volume, 8, 7, true);
      ASSERT_TRUE(cells() == cells_of(grid, 8, volume.box(), true)) << spike.x << ", " << brick_edge;
    }
  }
}

TEST_F(CoarsenedBricks, SameBytesForAnyThreadsMemoryAndGrid) {
  const Index3 dims{50, 41, 36};
  const auto samples = blobs<std::uint8_t>(dims, 3, 20);
  encode(samples, dims, {}, 8, 1);
  coarsen(9, false, Resources(1));
  const std::string mesh = file_content(vtu_);
  for (const int threads : sanitized ? std::vector{5} : std::vector{2, 5, 16}) {
    coarsen(9, false, Resources(threads));
    ASSERT_TRUE(file_content(vtu_) == mesh) << threads;
  }
  Resources tight(3);
  tight.memory = 64 << 20;
  coarsen(9, false, tight);
  EXPECT_TRUE(file_content(vtu_) == mesh);
  // The decoded voxels decide, not the grid of the file.
  encode(samples, dims, {false, true}, 8, 1);
  coarsen(9, false);
  EXPECT_TRUE(file_content(vtu_) == mesh);
}

TEST_F(CoarsenedBricks, AboveAllDifferencesOnlyRootTetrahedraAreLeft) {
  const Index3 dims{33, 17, 65};
  lead_ = 0;
  encode(blobs<std::uint8_t>(dims, 3, 20), dims, {}, 16, 2);
  EXPECT_EQ(coarsen(255, false).tetrahedra, 2 * 1 * 4 * 6);
  EXPECT_EQ(coarsen(1e300, true).points, 3 * 2 * 5);
}

}  // namespace
}  // namespace tagrid
