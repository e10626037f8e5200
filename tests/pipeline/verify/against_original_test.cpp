// Decoded rows against their original: the statistics, and the first voxel whose error is too large.
#include <gmock/gmock.h>

#include "io/errors/errors.h"
#include "io/formats/table/open_volume.h"
#include "io/metadata/text.h"
#include "pipeline/verify/against_original.h"
#include "pipeline/verify/verifier.h"
#include "pipeline/verify/verify.h"
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

// What a file and an original say of the place and the meaning of samples: the same in other words is the same, and a
// difference is named with both values.

GeometryComparison compared(const std::string& text, const std::string& of_original) {
  return compare_geometry(parse_metadata(text), parse_metadata(of_original));
}

using Texts = std::vector<std::string>;

const std::string lps =
    "space: left-posterior-superior\nspace directions: (0.5,0,0) (0,0.5,0) (0,0,2)\nspace origin: "
    "(10,-20,30)\n"
    "space units: \"mm\" \"mm\" \"mm\"\n";

TEST(GeometryOfBothTest, TheSameInOtherWordsIsTheSame) {
  const std::string others[] = {
      lps,
      // Another space, other units, and numbers that were float32.
      "space: RAS\nspace directions: (-0.5,0,0) (0,-0.5,0) (0,0,2)\nspace origin: (-10,20,30)\n",
      "space: LPS\nspace directions: (500,0,0) (0,500,0) (0,0,2000)\nspace origin: (10000,-20000,30000)\n"
      "space units: \"um\" \"um\" \"um\"\n",
      "space: LPS\nspace directions: (0.5,0.0000004,0) (0,0.49999997,0) (0,0,2.0000001)\n"
      "space origin: (10.0000005,-20,30)\n"};
  for (const std::string& other : others) {
    const GeometryComparison found = compared(lps, other);
    EXPECT_EQ(found.compared, (Texts{"spacing", "directions", "origin"})) << other;
    EXPECT_EQ(found.differences, Texts{}) << other;
  }
}

TEST(GeometryOfBothTest, ADifferenceIsNamedWithBothValues) {
  const std::pair<std::string, std::string> others[] = {
      {"spacings: 0.5 0.6 2\n", "the spacing along y is 0.5, but 0.6 in the original"},
      // The same number in another unit.
      {"spacings: 0.5 nan nan\nunits: \"um\" \"um\" \"um\"\n",
       "the spacing along x is 0.5, but 0.0005 in the original"},
      {"space: LPS\nspace directions: (0.5,0,0) (0,0.5,0) (0,0,2)\nspace origin: (10,-20,30.1)\n",
       "the origin is (10, -20, 30), but (10, -20, 30.1) in the original"},
      // The same numbers in another space.
      {"space: RAS\nspace directions: (0.5,0,0) (0,-0.5,0) (0,0,2)\n",
       "the direction of x is (0.5, 0, 0), but (-0.5, 0, 0) in the original"}};
  for (const auto& [other, difference] : others)
    EXPECT_EQ(compared(lps, other).differences, Texts{difference}) << other;
  EXPECT_EQ(compared("rescale_slope:=2\n", "rescale_slope:=2.5\n").differences,
            Texts{"rescale_slope is 2, but 2.5 in the original"});
}

TEST(GeometryOfBothTest, WhatCannotBeComparedIsLeftOut) {
  const std::string elsewhere =
      "space: scanner-xyz\nspace directions: (0,0.5,0) (0.5,0,0) (0,0,2)\nspace origin: (1,2,3)\n";
  EXPECT_EQ(compared(lps, elsewhere).compared, Texts{"spacing"});
  EXPECT_EQ(compared(lps, elsewhere).differences, Texts{});
  // A unit that is not one of lengths.
  const GeometryComparison steps = compared(lps, "spacings: 1 1 1\nunits: \"steps\" \"steps\" \"steps\"\n");
  EXPECT_EQ(steps.compared, Texts{});
  EXPECT_EQ(steps.differences, Texts{});
  EXPECT_EQ(compared(lps, "").compared, Texts{});
  EXPECT_EQ(compared("rescale_slope:=2\n", "").compared, Texts{});
}

TEST(GeometryOfBothTest, PositionsOfSlicesFollowTheSpace) {
  const std::string positions = "slice_positions:=1 2 3; 1 2 4; 1 2 9\n",
                    in_ras = "slice_positions:=-1 -2 3; -1 -2 4; -1 -2 9\n";
  const std::string ras = "space: RAS\nspace directions: (-0.5,0,0) (0,-0.5,0) (0,0,2)\n";
  EXPECT_EQ(compared(lps + positions, ras + in_ras).differences, Texts{});
  EXPECT_EQ(compared(lps + positions, ras + positions).differences.size(), 1U);
}

}  // namespace
}  // namespace tagrid
