// Bricks that agree on their faces are accepted, and a point on which they disagree is found, wherever the
// volume is cut into parts.
#include "pipeline/verify/verifier.h"
#include "tests/support/points.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace tagrid {
namespace {

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
