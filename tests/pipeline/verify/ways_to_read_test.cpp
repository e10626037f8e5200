// A file says the same whether it is read front to back or by its index, and both ways find the same damage.
#include "io/errors/errors.h"
#include "io/tag/bricks.h"
#include "io/tag/file.h"
#include "pipeline/verify/verifier.h"
#include "tests/support/points.h"
#include "tests/support/runs.h"
#include "tests/support/sanitized.h"
#include "tests/support/tag_in_memory.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

constexpr Index3 dims{21, 18, 19};

// The standard input of this process, as long as this object exists.
class StandardInput {
 public:
  explicit StandardInput(int descriptor) : kept_(dup(STDIN_FILENO)) {
    dup2(descriptor, STDIN_FILENO);
    close(descriptor);
  }
  ~StandardInput() {
    dup2(kept_, STDIN_FILENO);
    close(kept_);
  }
  StandardInput(const StandardInput&) = delete;
  StandardInput& operator=(const StandardInput&) = delete;

 private:
  int kept_;
};

class WaysToRead : public TemporaryFolder {
 protected:
  void encode(bool grid_only) {
    write_nrrd(path("in.nrrd"), dims, blobs<std::int16_t>(dims, 3));
    EncodeOptions options{.grid_only = grid_only, .cube_size = 8, .brick_edge = 1};
    encode_volume(path("in.nrrd"), {}, tag_, true, options, Resources(1));
    bytes_ = content("a.tag");
  }
  static bool is_whole_front_to_back(const std::string& bytes) {
    try {
      verify_bytes(std::make_unique<SourceStream>(std::make_shared<MemorySource>(bytes)), Resources(1));
      return true;
    } catch (const BrokenInput&) {
      return false;
    }
  }
  // Rows are verified last to first, each by itself.
  static bool is_whole_in_parts(const std::string& bytes) {
    try {
      const TagBricks file(std::make_shared<MemorySource>(bytes));
      const BrickGrid bricks = file.parameters().bricks();
      Verifier verifier(file, file.index(), verify_setup("", file.header(), std::nullopt, {}, Resources(1)));
      Watch unwatched;
      Statistics counted;
      OpenFacePairs faces(bricks);
      for (std::int64_t z = bricks.bricks(2) - 1; z >= 0; --z)
        for (std::int64_t y = bricks.bricks(1) - 1; y >= 0; --y) {
          const Findings found = verifier.verify({y, y + 1, z, z + 1}, unwatched);
          counted.add(found.counted);
          faces.add(found.open_faces);
        }
      if (const auto two = faces.first_difference()) verifier.tell_difference(*two);
      verifier.finish(counted, true, file.sizes());
      return true;
    } catch (const BrokenInput&) {
      return false;
    }
  }

  const std::string tag_ = path("a.tag");
  std::string bytes_;
};

TEST_F(WaysToRead, BricksFromAnyNumberOnAreThoseOfTheWholeFile) {
  encode(false);
  std::vector<BrickBytes> all;
  TagReader reader(tag_);
  for (BrickBytes brick; reader.read_brick(brick);) all.push_back(brick);
  const TagBricks file(std::make_shared<FileSource>(tag_));
  ASSERT_EQ(static_cast<std::int64_t>(all.size()), file.count());
  for (std::int64_t first = 0; first <= file.count(); ++first) {
    BricksInOrder bricks(file, first);
    EXPECT_EQ(bricks.name(), reader.name());
    auto expected = static_cast<std::size_t>(first);
    for (BrickBytes brick; bricks.read_brick(brick); ++expected) {
      ASSERT_LT(expected, all.size());
      EXPECT_EQ(brick.id, all[expected].id);
      EXPECT_EQ(brick.activity, all[expected].activity);
      EXPECT_EQ(brick.values, all[expected].values);
    }
    EXPECT_EQ(expected, all.size());
  }
}

TEST_F(WaysToRead, ASummaryIsThatOfAFileAPipeOrTheRestOfTheStandardInput) {
  encode(false);
  const TagSummary expected = summary_of(tag_);
  EXPECT_EQ(expected.sizes.file, bytes_.size());
  const auto expect_same = [&](const TagSummary& summary) {
    EXPECT_EQ(serialize_header(summary.header), serialize_header(expected.header));
    EXPECT_EQ(summary.index.total.active, expected.index.total.active);
    EXPECT_EQ(summary.sizes.file, expected.sizes.file);
    EXPECT_EQ(summary.sizes.values, expected.sizes.values);
  };
  {
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    ASSERT_EQ(write(ends[1], bytes_.data(), bytes_.size()), static_cast<ssize_t>(bytes_.size()));
    close(ends[1]);
    const StandardInput input(ends[0]);
    expect_same(summary_of("-"));
  }
  const std::string before = "read by somebody else", later = file("later", before + bytes_);
  const int descriptor = open(later.c_str(), O_RDONLY);
  lseek(descriptor, static_cast<off_t>(before.size()), SEEK_SET);
  const StandardInput input(descriptor);
  expect_same(summary_of("-"));
}

TEST_F(WaysToRead, PartsFindTheDamageThatIsFoundFrontToBack) {
  for (const bool grid_only : {false, true}) {
    encode(grid_only);
    EXPECT_TRUE(is_whole_front_to_back(bytes_));
    EXPECT_TRUE(is_whole_in_parts(bytes_));
    for (std::size_t at = 0; at < bytes_.size(); at += sanitized ? 211 : 41) {
      const std::string bad = flipped(bytes_, at, 4);
      EXPECT_FALSE(is_whole_front_to_back(bad)) << at;
      EXPECT_FALSE(is_whole_in_parts(bad)) << at;
    }
    for (const std::string& more : {std::string("x"), bytes_}) {
      EXPECT_FALSE(is_whole_front_to_back(bytes_ + more));
      EXPECT_FALSE(is_whole_in_parts(bytes_ + more));
    }
  }
}

// Bricks that agree on their faces are accepted, and a point on which they disagree is found, wherever the
// volume is cut into parts.

class SharedFacesTest : public testing::TestWithParam<FileMode> {
 protected:
  SharedFacesTest() {
    parameters_.dims = {10, 8, 12};
    parameters_.type = SampleType::int16;
    parameters_.mode = GetParam();
    parameters_.cube_size = 4;
    parameters_.brick_edge = 1;
    const BrickGrid bricks = parameters_.bricks();
    for (std::int64_t id = 0; id < bricks.count(); ++id) {
      DecodedBrick brick{id, LatticeBits(bricks.closed_box(bricks.position(id))), {}, {}};
      const Box& box = brick.active.box();
      if (has_points()) brick.points.resize(static_cast<std::size_t>(box.count()) * 2);
      for (const auto [x, y, z] : points_of(box)) {
        // The same in every brick that has the point.
        std::minstd_rand random(static_cast<unsigned>(1 + x + 100 * y + 10000 * z));
        random.discard(10);
        if (random() % 3 != 0) continue;
        brick.active.set({x, y, z});
        if (has_points())
          brick.points[static_cast<std::size_t>(box.offset({x, y, z})) * 2] =
              static_cast<std::byte>(random() % 200 + 1);
      }
      bricks_.push_back(std::move(brick));
    }
  }
  bool has_points() const { return GetParam() == FileMode::grid; }

  struct Found {
    std::int64_t brick;
    std::optional<Index3> point;
  };
  /// The first brick that disagrees with an earlier one, in parts that begin at `cuts`.
  std::optional<Found> found(std::vector<std::int64_t> cuts) const {
    std::optional<Found> first;
    const auto note = [&](Found found) {
      if (!first || found.brick < first->brick) first = found;
    };
    OpenFacePairs pairs(parameters_.bricks());
    cuts.insert(cuts.begin(), 0);
    cuts.push_back(static_cast<std::int64_t>(bricks_.size()));
    std::vector<std::vector<OpenFace>> open;
    for (std::size_t part = 0; part + 1 < cuts.size(); ++part) {
      SharedFaces faces(parameters_);
      for (std::int64_t id = cuts[part]; id < cuts[part + 1]; ++id)
        if (const auto point = faces.first_difference(bricks_[static_cast<std::size_t>(id)]))
          note({id, point});
      open.push_back(faces.open_faces());
    }
    // Parts come in any order.
    std::shuffle(open.begin(), open.end(), std::minstd_rand(static_cast<unsigned>(cuts.size())));
    for (const auto& faces : open) pairs.add(faces);
    if (const auto pair = pairs.first_difference()) note({pair->above, std::nullopt});
    return first;
  }
  std::vector<std::vector<std::int64_t>> all_cuts() const {
    std::vector<std::vector<std::int64_t>> all = {{}, {1, 2, 3}, {2, 9, 11}};
    std::vector<std::int64_t> everywhere;
    for (std::int64_t id = 1; id < static_cast<std::int64_t>(bricks_.size()); ++id) {
      all.push_back({id});
      everywhere.push_back(id);
    }
    all.push_back(everywhere);
    return all;
  }

  CodingParameters parameters_;
  std::vector<DecodedBrick> bricks_;
};

TEST_P(SharedFacesTest, BricksThatAgreeAreFoundToInAnyParts) {
  ASSERT_GT(bricks_.size(), 11U);
  for (const auto& cuts : all_cuts()) EXPECT_FALSE(found(cuts)) << cuts.size();
  SharedFaces all(parameters_);
  for (const DecodedBrick& brick : bricks_) all.first_difference(brick);
  EXPECT_TRUE(all.open_faces().empty());
}

TEST_P(SharedFacesTest, APointOnWhichTwoDisagreeIsFoundInAnyParts) {
  std::mt19937 random(1);
  const BrickGrid bricks = parameters_.bricks();
  for (int round = 0; round < 40; ++round) {
    const std::vector<DecodedBrick> good = bricks_;
    DecodedBrick& brick = bricks_[random() % bricks_.size()];
    const Index3 position = bricks.position(brick.id);
    const Box& box = brick.active.box();
    // On a face that it shares: a low or a high one.
    Index3 p;
    for (int axis = 0; axis < 3; ++axis)
      p[axis] = box.low[axis] + static_cast<std::int64_t>(random() % static_cast<unsigned>(box.size()[axis]));
    const int axis = static_cast<int>(random() % 3);
    if (bricks.bricks(axis) == 1) continue;
    p[axis] = position[axis] > 0 ? box.low[axis] : box.high[axis];
    if (has_points() && round % 2 == 0) {
      brick.points[static_cast<std::size_t>(box.offset(p)) * 2 + 1] ^= std::byte{1};
    } else {
      const auto bit = static_cast<std::size_t>(p.x - box.low.x);
      brick.active.row(p.y, p.z)[bit / 64] ^= std::uint64_t{1} << (bit % 64);
    }
    const auto whole = found({});
    ASSERT_TRUE(whole);
    EXPECT_EQ(whole->point, p);
    for (const auto& cuts : all_cuts()) {
      const auto in_parts = found(cuts);
      ASSERT_TRUE(in_parts);
      EXPECT_EQ(in_parts->brick, whole->brick) << cuts.size();
      EXPECT_TRUE(!in_parts->point || in_parts->point == p);
    }
    bricks_ = good;
  }
}

INSTANTIATE_TEST_SUITE_P(Of, SharedFacesTest, testing::Values(FileMode::voxels, FileMode::grid),
                         [](const auto& test) { return test.param == FileMode::grid ? "Grids" : "Voxels"; });

}  // namespace
}  // namespace tagrid
