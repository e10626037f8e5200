// A file that stores no grid has that of its decoded samples, and so has a lossless file. What is made of both is compared
// with what is made of a file that stores this grid in its bricks, with the exact values of its points: a grid alone.
#include <array>
#include <numeric>

#include "io/errors/errors.h"
#include "io/tag/bricks.h"
#include "io/tag/file.h"
#include "pipeline/meshes/mesh_builder.h"
#include "pipeline/verify/verifier.h"
#include "pipeline/verify/verify.h"
#include "tests/pipeline/library/library_calls.h"
#include "tests/support/awkward_volumes.h"
#include "tests/support/fake_ranks.h"
#include "tests/support/runs.h"
#include "tests/support/sanitized.h"
#include "tests/support/tag_in_memory.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

struct Mesh : MeshSink {
  std::vector<double> points;
  std::vector<std::byte> values;
  std::vector<std::int64_t> corners;
  std::vector<std::uint8_t> levels;

  void add_points(std::span<const double> xyz, std::span<const std::byte> v) override {
    points.insert(points.end(), xyz.begin(), xyz.end());
    values.insert(values.end(), v.begin(), v.end());
  }
  void add_tetrahedra(std::span<const std::int64_t> p, std::span<const std::uint8_t> l) override {
    corners.insert(corners.end(), p.begin(), p.end());
    levels.insert(levels.end(), l.begin(), l.end());
  }
  bool operator==(const Mesh& other) const {
    return points == other.points && values == other.values && corners == other.corners &&
           levels == other.levels;
  }
};

Mesh mesh_of(const std::string& file, const MeshPart& part, int threads) {
  Mesh mesh;
  if (part.box) {
    build_box<MeshBuilder>(TagBricks(std::make_shared<FileSource>(file)), part, Resources(threads), {}, mesh);
  } else {
    TagReader reader(file);
    build_all<MeshBuilder>(reader, part, Resources(threads), {}, mesh);
  }
  return mesh;
}

class DerivedGridOfFile : public TemporaryFolder {
 protected:
  /// Makes "derived.tag" and, from its decoded samples, "implied.tag", which is lossless, and "stored.tag".
  template <class T>
  void make(Index3 dims, const std::vector<T>& samples, EncodeOptions options, int threads = 2) {
    write_nrrd(path("in.nrrd"), dims, samples);
    options.grid = GridOrigin::derived;
    encode_volume(path("in.nrrd"), {}, derived_, true, options, Resources(threads));
    decode_volume(derived_, path("decoded.nrrd"), format_named("nrrd"), true, Resources(threads));
    EncodeOptions lossless = options;
    lossless.grid = GridOrigin::stored;
    lossless.max_error = 0;
    lossless.range.reset();
    lossless.field_scale = summary_of(derived_).header.parameters.field_scale;
    encode_volume(path("decoded.nrrd"), {}, implied_, true, lossless, Resources(threads));
    lossless.max_error.reset();
    lossless.grid_only = true;
    encode_volume(path("decoded.nrrd"), {}, stored_, true, lossless, Resources(threads));
  }

  const std::string derived_ = path("derived.tag"), implied_ = path("implied.tag"),
                    stored_ = path("stored.tag");
};

template <class T>
class DerivedGridOfType : public DerivedGridOfFile {};
TYPED_TEST_SUITE(DerivedGridOfType, AllTypes);

TYPED_TEST(DerivedGridOfType, IsTheGridOfTheDecodedSamples) {
  const Index3 shapes[] = {{19, 14, 17}, {33, 9, 40}, {1, 30, 21}, {70, 5, 6}, {9, 9, 9}};
  unsigned seed = 0;
  for (const Index3& dims : shapes)
    for (const auto& [cube, brick] : {std::pair{4, 1}, std::pair{4, 3}, std::pair{8, 2}, std::pair{16, 1}}) {
      ++seed;
      EncodeOptions options{.max_error = seed % 3 == 0 ? 0 : 6,
                            .accuracy = seed % 2 ? 20 : 5,
                            .cube_size = cube,
                            .brick_edge = brick};
      if (seed % 4 == 0) options.max_level = 5;
      options.range = {0, 128};
      this->make(dims, blobs<TypeParam>(dims, seed), options);
      SCOPED_TRACE(testing::Message()
                   << dims.x << "x" << dims.y << "x" << dims.z << ", cube " << cube << ", brick " << brick);
      const TagSummary stored = summary_of(this->stored_);
      for (const int threads : {1, 3})
        EXPECT_EQ(summary_with_levels(this->derived_, Resources(threads)).index.total.active,
                  stored.index.total.active);
      EXPECT_EQ(summary_of(this->implied_).index.total.active, stored.index.total.active);
      EXPECT_EQ(summary_of(this->implied_).header.parameters.grid, GridOrigin::implied);
      for (const std::string& file : {this->derived_, this->implied_})
        EXPECT_EQ(summary_of(file).sizes.activity, 0U);
      EXPECT_EQ(verify_file(this->derived_, this->path("in.nrrd"), {}, Resources(2)).active_points,
                verify_file(this->stored_, std::nullopt, {}, Resources(2)).active_points);
      EXPECT_EQ(verify_file(this->implied_, std::nullopt, {}, Resources(2)).active_points,
                verify_file(this->stored_, std::nullopt, {}, Resources(2)).active_points);
      for (const bool padded : {false, true})
        for (const int level : {max_level(cube), 4}) {
          const MeshPart part = {level, padded};
          if (!padded && is_flat(stored.header.parameters)) continue;
          const Mesh expected = mesh_of(this->stored_, part, 1);
          EXPECT_TRUE(mesh_of(this->derived_, part, 3) == expected);
          EXPECT_TRUE(mesh_of(this->implied_, part, 2) == expected);
        }
      if (this->HasFailure()) return;
    }
}

TEST_F(DerivedGridOfFile, AnyBoxHasTheMeshOfTheWholeGrid) {
  const Index3 dims = {67, 30, 41};
  std::mt19937 random(1);
  for (const auto& [cube, brick] : {std::pair{4, 1}, std::pair{4, 4}, std::pair{8, 1}, std::pair{16, 2}}) {
    EncodeOptions options{.max_error = 3, .cube_size = cube, .brick_edge = brick, .range = {{0, 128}}};
    make(dims, blobs<std::int16_t>(dims, 7), options);
    for (int i = 0; i < (sanitized ? 6 : 25); ++i) {
      MeshPart part = {max_level(cube), i % 5 == 0};
      Box box;
      for (int axis = 0; axis < 3; ++axis) {
        const auto n = static_cast<std::uint64_t>(dims[axis]);
        const auto a = static_cast<std::int64_t>(random() % n), b = static_cast<std::int64_t>(random() % n);
        box.low[axis] = std::min(a, b);
        box.high[axis] = i % 2 ? box.low[axis] : std::max(a, b);
      }
      part.box = Domain{dims, cube, options.lead}.points_of(box);
      const Mesh expected = mesh_of(stored_, part, 1);
      EXPECT_FALSE(expected.levels.empty());
      EXPECT_TRUE(mesh_of(i % 2 ? implied_ : derived_, part, 1 + i % 3) == expected)
          << "cube " << cube << " brick " << brick << ": " << box.low.x << ".." << box.high.x << " "
          << box.low.y << ".." << box.high.y << " " << box.low.z << ".." << box.high.z;
      if (HasFailure()) return;
    }
  }
}

TEST_F(DerivedGridOfFile, VerifyingComparesTheNumbersOfPointsIfThereIsMemory) {
  const Index3 dims = {40, 60, 27};
  write_nrrd(path("in.nrrd"), dims, blobs<std::uint8_t>(dims, 3));
  encode_volume(path("in.nrrd"), {}, implied_, true, {.cube_size = 4, .brick_edge = 2}, Resources(2));
  EXPECT_GT(verify_file(implied_, path("in.nrrd"), {}, Resources(2)).active_points, 0U);

  const TagBricks file(std::make_shared<FileSource>(implied_));
  const CodingParameters& p = file.parameters();
  TagIndex index = file.index();
  ++index.total.active[3];
  Verifier verifier(file, index, {plan_verifying(p, Resources(2))});
  Watch unwatched;
  const Findings found = verifier.verify(BrickRows::all(p.bricks()), unwatched);
  EXPECT_TRUE(found.has_points);
  EXPECT_THROW(verifier.finish(found.counted, found.has_points, file.sizes()), BrokenInput);

  Resources little(1);
  little.memory = std::uint64_t{1} << 30;
  DecodePlan whole = plan_verifying(p, little);
  while (whole.derives) {
    little.memory = whole.memory - 1;
    whole = plan_verifying(p, little);
  }
  EXPECT_FALSE(verify_file(implied_, std::nullopt, {}, little).active_points);
}

TEST_F(DerivedGridOfFile, TheValuesAreThoseOfAFileThatStoresItsGrid) {
  const Index3 dims = {40, 33, 27};
  for (const Effort effort : {Effort::fast, Effort::normal, Effort::best}) {
    EncodeOptions options{.max_error = 2, .cube_size = 8, .effort = effort};
    const auto samples = blobs<std::uint8_t>(dims, 3);
    make(dims, samples, options);
    options.grid = GridOrigin::stored;
    encode_volume(path("in.nrrd"), {}, stored_, true, options, Resources(2));
    const TagBricks derived(std::make_shared<FileSource>(derived_)),
        stored(std::make_shared<FileSource>(stored_));
    ASSERT_EQ(derived.count(), stored.count());
    for (std::int64_t id = 0; id < derived.count(); ++id) {
      EXPECT_EQ(derived.read(id).values, stored.read(id).values);
      EXPECT_TRUE(derived.read(id).activity.empty());
    }
    EXPECT_EQ(derived.index().total.max_error, stored.index().total.max_error);
    EXPECT_EQ(derived.index().total.finite, stored.index().total.finite);
  }
}

TEST_F(DerivedGridOfFile, TheFileIsTheSameInStripsAndInPartsOnRanks) {
  const Index3 dims = sanitized ? Index3{24, 29, 37} : Index3{40, 61, 37};
  EncodeOptions options{.max_error = 4, .cube_size = 4, .brick_edge = 1};
  make(dims, blobs<std::int16_t>(dims, 5), options, 1);
  const std::string expected = file_content(derived_);
  options.grid = GridOrigin::derived;
  Resources little(2);
  CodingParameters parameters = summary_of(derived_).header.parameters;
  // And a little for what is known of the source files.
  little.memory = smallest_memory_of_encoding(parameters, true, std::uint64_t{1} << 20);
  encode_volume(path("in.nrrd"), {}, path("strips.tag"), true, options, little);
  EXPECT_TRUE(file_content(path("strips.tag")) == expected);
  by(3, [&](Ranks& ranks) {
    committed(encode_volume(ranks, {.input = path("in.nrrd"),
                                    .output = path("parts.tag"),
                                    .options = options,
                                    .resources = Resources(1)}));
    EXPECT_EQ(verify_file(
                  ranks, {.input = path("parts.tag"), .original = path("in.nrrd"), .resources = Resources(1)})
                  .active_points,
              verify_file(stored_, std::nullopt, {}, Resources(1)).active_points);
  });
  EXPECT_TRUE(file_content(path("parts.tag")) == expected);
}

TEST_F(DerivedGridOfFile, EveryStretchOfRowsHasItsGrid) {
  const Index3 dims = {30, 41, 35};
  EncodeOptions options{.max_error = 4, .cube_size = 4, .brick_edge = 2};
  make(dims, blobs<std::int16_t>(dims, 5), options);
  // With a bound, bricks store the grid of the original: here, of the samples that the derived file decodes to.
  options.max_error = 1;
  options.field_scale = summary_of(derived_).header.parameters.field_scale;
  encode_volume(path("decoded.nrrd"), {}, stored_, true, options, Resources(2));
  const TagBricks derived(std::make_shared<FileSource>(derived_)),
      stored(std::make_shared<FileSource>(stored_));
  const BrickGrid bricks = derived.parameters().bricks();
  Verifier of_derived(derived, derived.index(),
                      verify_setup("", derived.header(), std::nullopt, {}, Resources(1))),
      of_stored(stored, stored.index(), verify_setup("", stored.header(), std::nullopt, {}, Resources(1)));
  Watch unwatched;
  for (std::int64_t z = 0; z < bricks.bricks(2); ++z)
    for (std::int64_t y = 0; y < bricks.bricks(1); ++y)
      for (const std::int64_t rows : {1, 2, 3}) {
        if (y + rows > bricks.bricks(1)) continue;
        const BrickRows stretch = {y, y + rows, z, z + 1};
        const Findings a = of_derived.verify(stretch, unwatched), b = of_stored.verify(stretch, unwatched);
        EXPECT_EQ(a.counted.active, b.counted.active);
        ASSERT_EQ(a.open_faces.size(), b.open_faces.size());
        for (std::size_t i = 0; i < a.open_faces.size(); ++i)
          EXPECT_EQ(a.open_faces[i].checksum, b.open_faces[i].checksum);
      }
}

TEST_F(DerivedGridOfFile, ABrickWithAGridIsRefused) {
  const Index3 dims = {9, 8, 7};
  EncodeOptions options{.cube_size = 8};
  make(dims, blobs<std::uint8_t>(dims, 5), options);
  const TagBricks file(std::make_shared<FileSource>(derived_));
  const BrickBytes brick = file.read(0);
  DecodedBrick decoded;
  for (const Wanted wanted : {Wanted::samples, Wanted::samples_and_grid}) {
    EXPECT_TRUE(decode_brick({brick.activity, brick.values}, file.parameters(), {0, wanted}, decoded).ok());
    const std::vector<std::uint8_t> activity = {0};
    EXPECT_FALSE(decode_brick({activity, brick.values}, file.parameters(), {0, wanted}, decoded).ok());
  }
}

TEST_F(DerivedGridOfFile, TheLibraryCountsItsLevels) {
  const Index3 dims = {21, 18, 30};
  EncodeOptions options{.max_error = 3, .cube_size = 8};
  make(dims, blobs<std::int16_t>(dims, 5), options);
  const auto levels_of = [](const std::string& file, int derived) {
    tagrid_reader* opened = nullptr;
    EXPECT_EQ(tagrid_reader_open_file(file.c_str(), &opened), TAGRID_OK);
    const ReaderHandle reader(opened);
    const tagrid_info info = info_of(opened);
    EXPECT_EQ(info.grid_derived, derived);
    std::vector<std::uint64_t> active(static_cast<std::size_t>(info.levels) + 1);
    EXPECT_EQ(tagrid_reader_levels(opened, active.data(), nullptr), TAGRID_OK);
    EXPECT_EQ(tagrid_reader_levels(opened, nullptr, nullptr), TAGRID_INVALID_ARGUMENT);
    EXPECT_EQ(info.active_points,
              derived ? 0 : std::accumulate(active.begin(), active.end(), std::uint64_t{0}));
    return active;
  };
  EXPECT_EQ(levels_of(derived_, 1), levels_of(stored_, 0));
}

// Samples that are not finite, noise, constants and volumes thinner than a root cube.
TEST_F(DerivedGridOfFile, AwkwardVolumesHaveTheirGrid) {
  const Index3 dims = {21, 18, 10};
  for (int kind = 0; kind < static_cast<int>(Awkward::count); ++kind) {
    EncodeOptions options{.max_error = 1, .cube_size = 8, .brick_edge = 1, .field_scale = 0.05};
    make(dims, awkward_volume<float>(static_cast<Awkward>(kind), dims, 3), options);
    EXPECT_EQ(summary_with_levels(derived_, Resources(2)).index.total.active,
              summary_of(stored_).index.total.active)
        << name_of(static_cast<Awkward>(kind));
    EXPECT_NO_THROW(verify_file(derived_, path("in.nrrd"), {}, Resources(2)));
  }
}

}  // namespace
}  // namespace tagrid
