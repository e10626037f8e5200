// What a file and an original say of the place and the meaning of samples: the same in other words is the same, and a
// difference is named with both values.
#include "io/metadata/text.h"
#include "pipeline/verify/verify.h"

#include <gtest/gtest.h>

namespace tagrid {
namespace {

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
