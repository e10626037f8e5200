// The promise of a mesh's bound, and the recorded error: checked in the written mesh, by searching for every
// sample in its tetrahedra.
#include "io/errors/errors.h"
#include "io/files/output_file.h"
#include "io/tag/bricks.h"
#include "io/tag/file.h"
#include "pipeline/verify/verifier.h"
#include "tests/support/awkward_volumes.h"
#include "tests/support/mesh_field.h"
#include "tests/support/runs.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

struct Bounds {
  bool grid;
  std::optional<double> max_error, surface_error, mesh_error;
};

std::string text(const std::optional<double>& bound) { return bound ? std::to_string(*bound) : "none"; }

template <class T>
class MeshError : public TemporaryFolder {
 protected:
  const std::string in_ = path("in.nrrd"), tag_ = path("a.tag");
  int encoded_ = 0;

  // The largest error of the field of the mesh that `mesh` writes.
  double error_of_mesh(const std::vector<T>& samples, Index3 dims) {
    write_mesh(tag_, path("a.vtu"), {{}, false, true}, Resources(1));
    Vtu vtu(path("a.vtu"));
    const LatticeMesh mesh = read_lattice_mesh(vtu);
    const std::vector<T> values = vtu.array<T>(vtk_type<T>(), "value");
    const Box box = Box::of_size(dims);
    std::vector<bool> seen(samples.size());
    double worst = 0;
    for_each_point_in_mesh(mesh, box, [&](Index3 p, std::size_t t, const auto& weights, std::int64_t six) {
      const auto at = static_cast<std::size_t>(box.offset(p));
      seen[at] = true;
      if constexpr (std::is_integral_v<T>) {
        std::int64_t sum = 0;
        for (std::size_t i = 0; i < 4; ++i)
          sum += weights[i] * std::int64_t{values[static_cast<std::size_t>(mesh.ids(t)[i])]};
        const std::int64_t difference = std::abs(sum - six * std::int64_t{samples[at]});
        worst = std::max(worst, static_cast<double>(difference) / static_cast<double>(six));
      } else {
        if (!std::isfinite(samples[at])) return;
        long double sum = 0;
        for (std::size_t i = 0; i < 4; ++i)
          if (weights[i] != 0)
            sum += static_cast<long double>(weights[i]) *
                   static_cast<long double>(values[static_cast<std::size_t>(mesh.ids(t)[i])]);
        const long double error = std::fabs(sum / static_cast<long double>(six) - samples[at]);
        worst = std::max(worst, static_cast<double>(error));
      }
    });
    EXPECT_TRUE(std::all_of(seen.begin(), seen.end(), [](bool b) { return b; })) << "the mesh has holes";
    return worst;
  }

  void expect_promise(const std::vector<T>& samples, Index3 dims, const Bounds& bounds, int cube_size,
                      int brick_edge = 1) {
    SCOPED_TRACE("E " + text(bounds.max_error) + ", F " + text(bounds.surface_error) + ", M " +
                 text(bounds.mesh_error) + (bounds.grid ? ", grid, " : ", ") + std::to_string(dims.x) + "x" +
                 std::to_string(dims.y) + "x" + std::to_string(dims.z) + ", S " + std::to_string(cube_size));
    EncodeOptions options{.grid_only = bounds.grid,
                          .max_error = bounds.max_error,
                          .surface_error = bounds.surface_error,
                          .mesh_error = bounds.mesh_error,
                          .cube_size = cube_size,
                          .brick_edge = brick_edge,
                          .lead = encoded_++ % 2};
    write_nrrd(in_, dims, samples);
    const EncodeResult encoded = encode_volume(in_, {}, tag_, true, options, Resources(2));
    const double recorded = encoded.index.total.mesh_error, found = error_of_mesh(samples, dims);
    if constexpr (std::is_integral_v<T>) {
      ASSERT_EQ(recorded, found);
    } else {
      ASSERT_NEAR(recorded, found, 1e-9 * std::max(1.0, found));
    }
    ASSERT_LE(recorded, *bounds.mesh_error);
    const VerifyResult verified = verify_file(tag_, in_, {}, Resources(2));
    ASSERT_EQ(verified.mesh_error, recorded);
    ASSERT_EQ(verified.index.total.mesh_error, recorded);
  }
};

TYPED_TEST_SUITE(MeshError, AllTypes);

const Bounds all_bounds[] = {{false, {}, {}, 0}, {false, {}, {}, 1},  {false, {}, {}, 5}, {false, 2, {}, 5},
                             {false, 2, {}, 2},  {false, 3, {}, 4},   {false, 8, 1, 4},   {false, 8, 2, 2},
                             {false, 8, 1, 12},  {false, 10, 3, 10},  {true, {}, {}, 0},  {true, {}, {}, 6},
                             {true, 4, {}, 3},   {true, 3, {}, 4},    {true, 1, {}, 1},   {true, 9, {}, 1},
                             {true, 0, {}, 2},   {false, 20, 0, 7.5}, {true, 5, {}, 2.5}};

// Sizes that end on root cubes, just after them, and just before them.
const Index3 sizes[] = {{13, 10, 19}, {9, 9, 9}, {2, 5, 7}, {14, 6, 11}, {10, 17, 8}, {2, 2, 2}};

TYPED_TEST(MeshError, TheRecordedErrorIsThatOfTheMeshAndWithinItsBound) {
  unsigned seed = 0;
  for (const Index3 dims : sizes)
    for (const Bounds& bounds : all_bounds) {
      const auto samples =
          ++seed % 2 ? blobs<TypeParam>(dims, seed) : awkward_volume<TypeParam>(Awkward::noise, dims, seed);
      this->expect_promise(samples, dims, bounds, seed % 3 ? 8 : 16);
      if (this->HasFatalFailure()) return;
    }
}

TYPED_TEST(MeshError, HoldsOnVolumesThatAreHardOnACoder) {
  for (int kind = 0; kind < static_cast<int>(Awkward::count); ++kind)
    for (const Bounds& bounds :
         {Bounds{false, 3, {}, 7}, {false, 8, 1, 4}, {true, 4, {}, 3}, {false, 2, {}, 2}}) {
      SCOPED_TRACE(name_of(Awkward(kind)));
      const auto samples = awkward_volume<TypeParam>(Awkward(kind), {11, 14, 10}, 3);
      this->expect_promise(samples, {11, 14, 10}, bounds, 8);
      if (this->HasFatalFailure()) return;
    }
}

// A narrow slope, on which interpolation is easy and cuts are many.
TYPED_TEST(MeshError, RoundedPointsOfCutsCount) {
  const Index3 dims{7, 12, 10};
  std::vector<TypeParam> samples;
  for (std::int64_t i = 0; i < Box::of_size(dims).count(); ++i)
    samples.push_back(static_cast<TypeParam>((i % 7 + 2 * (i / 7 % 12) + i / 84) / 3));
  for (const double m : {0.0, 1.0, 2.0, 3.0})
    this->expect_promise(samples, dims, {false, std::min(m, 1.0), {}, m}, 16);
}

// A flat region has no marks, but the samples before it in its brick affect its decoded values, and those
// outside the active points may have a larger error than the mesh.
TYPED_TEST(MeshError, HoldsAtTheBorderOfAFlatTileBehindNoise) {
  for (const std::int64_t n : {22, 23, 24})
    for (unsigned seed = 1; seed < 4; ++seed) {
      const Index3 dims{n, n, n};
      auto samples = awkward_volume<TypeParam>(Awkward::noise, dims, seed);
      for (TypeParam& v : samples) v = static_cast<TypeParam>(v / 5);
      std::fill(samples.begin() + 12 * n * n, samples.end(), static_cast<TypeParam>(30 + seed));
      this->expect_promise(samples, dims, {false, 30, 1, 4}, 8, 3);
    }
}

class MeshErrorRecord : public MeshError<std::int16_t> {
 protected:
  MeshErrorRecord() {
    options_.cube_size = 8;
    options_.brick_edge = 1;
    write_nrrd(in_, dims_, samples_);
  }
  EncodeResult encode(double max_error, double mesh_error) {
    options_.max_error = max_error;
    options_.mesh_error = mesh_error;
    return encode_volume(in_, {}, tag_, true, options_, Resources(2));
  }
  // a.tag with another bound, and another record.
  void forge(double bound, double recorded) const {
    TagReader reader(tag_);
    std::vector<BrickBytes> bricks;
    std::vector<IndexEntry> entries;
    reader.look_at_pages(
        [&](std::span<const IndexEntry> page) { entries.insert(entries.end(), page.begin(), page.end()); });
    for (BrickBytes brick; reader.read_brick(brick);) bricks.push_back(brick);
    TagHeader header = reader.header();
    header.parameters.mesh_error = bound;
    OutputFile out(path("forged.tag"), true);
    TagWriter writer(out, header);
    Statistics total = reader.index().total;
    total.mesh_error = recorded;
    for (const BrickBytes& brick : bricks) {
      const IndexEntry& entry = entries[static_cast<std::size_t>(brick.id)];
      Statistics one;
      if (brick.id == 0) one = total;
      one.low = entry.low, one.high = entry.high;
      writer.write_brick(brick, one);
    }
    writer.finish();
    out.commit();
  }
  std::string complaint(const std::optional<std::string>& original) const {
    return message_of<BrokenInput>([&] { verify_file(path("forged.tag"), original, {}, Resources(1)); });
  }

  const Index3 dims_{21, 18, 13};
  const std::vector<std::int16_t> samples_ = blobs<std::int16_t>(dims_, 4, 20);
  EncodeOptions options_;
};

TEST_F(MeshErrorRecord, VerifyMeasuresTheMeshItself) {
  const double reached = encode(2, 9).index.total.mesh_error;
  ASSERT_GT(reached, 3);
  forge(9, reached);
  EXPECT_NO_THROW(verify_file(path("forged.tag"), in_, {}, Resources(1)));
  forge(9, reached - 0.25);
  EXPECT_NO_THROW(verify_file(path("forged.tag"), std::nullopt, {}, Resources(1)))
      << "nothing is known without the original";
  EXPECT_TRUE(has(complaint(in_), "the recorded errors"));
  forge(3, 2.5);
  EXPECT_TRUE(has(complaint(in_), "the mesh differs from the original by up to"));
  forge(3, reached);
  EXPECT_TRUE(has(complaint(std::nullopt), "above the bound"));
  forge(9, NAN);
  EXPECT_TRUE(has(complaint(std::nullopt), "not a number"));
}

// Verifies rows in any order, as several processes do.
TEST_F(MeshErrorRecord, IsWhatIsFoundRowByRow) {
  const double recorded = encode(2, 9).index.total.mesh_error;
  const TagBricks file(std::make_shared<FileSource>(tag_));
  Verifier verifier(file, file.index(), verify_setup(file.name(), file.header(), in_, {}, Resources(1)));
  Watch unwatched;
  const BrickGrid bricks = verifier.parameters().bricks();
  Statistics counted;
  for (std::int64_t z = bricks.bricks(2) - 1; z >= 0; --z)
    for (std::int64_t y = 0; y < bricks.bricks(1); ++y)
      counted.add(verifier.verify({y, y + 1, z, z + 1}, unwatched).counted);
  EXPECT_EQ(counted.mesh_error, recorded);
  EXPECT_NO_THROW(verifier.finish(counted, true, file.sizes()));
}

TEST_F(MeshErrorRecord, IsNotThereWithoutABoundOfTheMesh) {
  for (const bool grid : {false, true}) {
    EncodeOptions options{.grid_only = grid, .max_error = 4};
    EXPECT_LT(encode_volume(in_, {}, tag_, true, options, Resources(1)).index.total.mesh_error, 0);
    EXPECT_FALSE(verify_file(tag_, in_, {}, Resources(1)).mesh_error.has_value());
  }
}

// Bounds as the advice says are among those of above.
TEST_F(MeshErrorRecord, AMeshBoundBelowThatOfItsValuesIsRefusedWithAdvice) {
  const std::string message = message_of<UsageError>([&] { encode(10, 3); });
  for (const char* advice :
       {"bound of the mesh 10 or more", "largest error 3 or less", "or add the bound of the active points 3"})
    EXPECT_TRUE(has(message, advice));
  EXPECT_EQ(names(), std::vector<std::string>{"in.nrrd"});
  options_.surface_error = 5;
  const std::string second = message_of<UsageError>([&] { encode(10, 3); });
  for (const char* advice : {"bound of the mesh 5 or more", "active points 3 or less"})
    EXPECT_TRUE(has(second, advice));
}

TEST_F(MeshErrorRecord, AVolumeOfOneSliceHasOneToo) {
  const std::vector<std::int16_t> slice = blobs<std::int16_t>({21, 18, 1}, 4, 20);
  write_nrrd(in_, {21, 18, 1}, slice);
  for (const std::optional<double> surface : {std::optional<double>(), std::optional<double>(1)}) {
    options_.surface_error = surface;
    const EncodeResult result = encode(3, 7);
    EXPECT_LE(result.index.total.mesh_error, 7);
    EXPECT_EQ(verify_file(tag_, in_, {}, Resources(1)).mesh_error, result.index.total.mesh_error);
  }
}

}  // namespace
}  // namespace tagrid
