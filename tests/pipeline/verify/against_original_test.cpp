// Decoded rows against their original: the statistics, and the first voxel whose error is too large.
#include "pipeline/verify/against_original.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/errors/errors.h"
#include "io/formats/table/open_volume.h"
#include "pipeline/verify/verifier.h"
#include "tests/support/rows_of_volume.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace tagrid {
namespace {

class AgainstOriginalTest : public TemporaryFolder {
 protected:
  AgainstOriginalTest() : original_(blobs<std::int16_t>(dims_, 1)), decoded_(original_) {
    parameters_.dims = dims_;
    parameters_.type = SampleType::int16;
    parameters_.cube_size = 4;
    parameters_.brick_edge = 1;
    parameters_.lead = 1;
    parameters_.max_error = 5;
    write_nrrd(path("a.nrrd"), dims_, original_);
  }

  std::int16_t& decoded(Index3 p) {
    return decoded_[static_cast<std::size_t>(Box::of_size(dims_).offset(p))];
  }
  VerifySetup opened() const {
    return verify_setup("a.tag", {parameters_, {}}, path("a.nrrd"), {}, Resources(1));
  }

  /// The statistics of all rows, `together` rows of bricks at a time. `active` gives the activity of every
  /// brick.
  Statistics compare(std::int64_t together, std::optional<Index3> active = std::nullopt) const {
    const VerifySetup setup = opened();
    AgainstOriginal& against = *setup.against;
    Statistics errors;
    const BrickGrid bricks = parameters_.bricks();
    // Activity comes before its rows.
    std::int64_t next = 0;
    for_each_rows<std::int16_t>(parameters_, BrickRows::all(bricks), together, decoded_,
                                [&](const DecodedRows& rows) {
                                  for (; next < bricks.count(); ++next) {
                                    const Box owned = bricks.owned_box(bricks.position(next));
                                    if (!rows.box().contains(owned.low)) break;
                                    LatticeBits bits(bricks.closed_box(bricks.position(next)));
                                    const Index3 first = parameters_.domain().first();
                                    if (active && bits.box().contains(*active + first))
                                      bits.set(*active + first);
                                    against.add_activity(bits);
                                  }
                                  against.compare(rows, errors);
                                });
    against.finish();
    return errors;
  }
  void expect_refused(const std::string& what, std::optional<Index3> active = std::nullopt) const {
    for (const std::int64_t together : {1, 3, 100}) try {
        compare(together, active);
        ADD_FAILURE() << what;
      } catch (const BrokenInput& broken) {
        EXPECT_TRUE(has(std::string(broken.what()), "a.tag: voxel " + what)) << broken.what();
      }
  }

  static constexpr Index3 dims_{9, 14, 11};
  std::vector<std::int16_t> original_, decoded_;
  CodingParameters parameters_;
};

TEST_F(AgainstOriginalTest, ErrorsWithinTheBoundAreCountedWhateverTheRows) {
  decoded({0, 0, 0}) = static_cast<std::int16_t>(decoded({0, 0, 0}) + 5);
  decoded({8, 13, 10}) = static_cast<std::int16_t>(decoded({8, 13, 10}) - 3);
  for (const std::int64_t together : {1, 2, 100}) {
    const Statistics errors = compare(together);
    EXPECT_EQ(errors.max_error, 5);
    EXPECT_TRUE(errors.sum_squared_error == 34);
  }
}

TEST_F(AgainstOriginalTest, AVoxelBeyondTheBoundIsNamedWithBothValues) {
  const Index3 p{7, 12, 9};
  decoded(p) = static_cast<std::int16_t>(decoded(p) + 6);
  expect_refused("(7, 12, 9) is " + std::to_string(decoded(p)) + ", but " + std::to_string(decoded(p) - 6) +
                 " in the original; they differ by more than 5");
}

TEST_F(AgainstOriginalTest, ActiveVoxelsHaveTheTighterBoundInEveryBrickOfTheRows) {
  parameters_.surface_error = 2;
  for (const Index3 p : {Index3{0, 0, 0}, {4, 4, 4}, {5, 8, 8}, {8, 13, 10}}) {
    const std::int16_t was = decoded(p);
    decoded(p) = static_cast<std::int16_t>(was + 3);
    EXPECT_EQ(compare(2).max_error, 3) << "where it is not active";
    expect_refused("(" + std::to_string(p.x), p);
    decoded(p) = was;
  }
}

TEST_F(AgainstOriginalTest, WithoutABoundNothingIsTooFarOff) {
  parameters_.max_error = -1;
  decoded({1, 1, 1}) = 30000;
  EXPECT_GT(compare(1).max_error, 20000);
}

TEST_F(AgainstOriginalTest, AnOriginalOfAnotherSizeOrTypeIsRefused) {
  parameters_.dims = {9, 14, 12};
  EXPECT_THROW(opened(), BrokenInput);
  parameters_.dims = dims_;
  parameters_.type = SampleType::uint16;
  EXPECT_THROW(opened(), BrokenInput);
}

// Bytes after the samples are no part of the volume, which a warning of the source says; the source files are compared elsewhere.
TEST_F(AgainstOriginalTest, OfAnOriginalThatGoesOnTheSamplesAreCompared) {
  write_content(path("a.nrrd"), content("a.nrrd") + "x");
  EXPECT_EQ(compare(1).max_error, 0);
  EXPECT_THAT(open_volume(path("a.nrrd"), {})->facts().warnings,
              testing::ElementsAre(testing::HasSubstr("1 bytes follow")));
}

TEST_F(AgainstOriginalTest, RowsOfAFileMayComeInAnyOrder) {
  const BrickGrid bricks = parameters_.bricks();
  const VerifySetup setup = opened();
  ASSERT_TRUE(setup.any_order);
  AgainstOriginal& against = *setup.against;
  Statistics errors;
  decoded({3, 3, 3}) = static_cast<std::int16_t>(decoded({3, 3, 3}) + 4);
  for (std::int64_t z = bricks.bricks(2) - 1; z >= 0; --z)
    for (std::int64_t y = bricks.bricks(1) - 1; y >= 0; --y)
      for_each_rows<std::int16_t>(parameters_, {y, y + 1, z, z + 1}, 1, decoded_,
                                  [&](const DecodedRows& rows) { against.compare(rows, errors); });
  against.finish();
  EXPECT_EQ(errors.max_error, 4);
  EXPECT_TRUE(errors.sum_squared_error == 16);
}

}  // namespace
}  // namespace tagrid
