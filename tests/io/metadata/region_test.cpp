// The description of a region: its samples have the same positions as in the whole volume.
#include "io/metadata/region.h"
#include "io/metadata/text.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "tests/support/metadata.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

const std::vector<std::string> geometries = {
    "spacings: 0.5 0.25 2\n",
    "spacings: 0.5 -0.25 2\naxis mins: -3 4 5\n",
    "spacings: 0.5 0.25 2\naxis mins: -3 4 5\ncenters: node cell node\n",
    "spacings: 1 nan 2\n",
    "space: left-posterior-superior\nspace directions: (0.5,0,0) (0,0.75,0) (0,0,3)\n",
    "space: LPS\nspace directions: (0.5,0.25,0) (-0.125,0.75,0) (0,0.5,3)\nspace origin: (10,-20,30)\n",
};

std::string text_of_region(const std::string& whole, Index3 low, Index3 step, std::int64_t slices,
                           std::int64_t all_slices) {
  return text_of(metadata_of_region(parse_metadata(whole), low, step, slices, all_slices));
}

RC_GTEST_PROP(MetadataOfRegion, PutEverySampleWhereItWas, ()) {
  const std::string fields = *rc::gen::elementOf(geometries);
  const auto number = [](int most) { return static_cast<std::int64_t>(*rc::gen::inRange(0, most)); };
  const Index3 low = {number(40), number(40), number(40)};
  const Index3 step = {number(4) + 1, number(4) + 1, number(4) + 1};
  const Geometry whole = geometry_of(fields), region = geometry_of(text_of_region(fields, low, step, 8, 64));
  for (const Index3& p : {Index3{0, 0, 0}, Index3{1, 0, 0}, Index3{3, 7, 5}}) {
    const auto was = to_world(whole, low + Index3{p.x * step.x, p.y * step.y, p.z * step.z});
    const auto is = to_world(region, p);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      // An unknown spacing stays unknown: along such an axis, samples count as 1 apart, before and after.
      if (std::isnan(whole.spacing[axis])) continue;
      RC_ASSERT(std::abs(was[axis] - is[axis]) < 1e-9);
    }
  }
}

TEST(MetadataOfRegion, OfTheWholeVolumeAreTheSameToTheByte) {
  for (const std::string& fields : geometries)
    EXPECT_EQ(text_of_region(fields, {0, 0, 0}, {1, 1, 1}, 8, 64), fields);
}

TEST(MetadataOfRegion, KeepEverythingElse) {
  const std::string others = "content: a scan\n# made by hand\nspace units: \"mm\" \"mm\" \"mm\"\nkVp:=120\n";
  const std::string fields = others + "space: LPS\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n";
  const std::string region = text_of_region(fields, {1, 2, 3}, {2, 2, 2}, 8, 64);
  EXPECT_EQ(region.substr(0, others.size()), others);
  EXPECT_EQ(region.substr(others.size()),
            "space: LPS\nspace directions: (2,0,0) (0,2,0) (0,0,2)\nspace origin: (1,2,3)\n");
}

TEST(MetadataOfRegion, ForgetTheEndsOfTheWholeVolume) {
  const std::string fields = "spacings: 1 1 1\naxis mins: 0 0 0\naxis maxs: 10 10 10\n";
  EXPECT_EQ(text_of_region(fields, {2, 0, 0}, {1, 1, 1}, 8, 64), "spacings: 1 1 1\naxis mins: 2 0 0\n");
}

TEST(MetadataOfRegion, InventNoPlaceWhereTheSpacingIsNotKnown) {
  struct Case {
    std::string whole;
    Index3 low, step;
    std::string region;
  };
  const std::string mins = "axis mins: 0.1 4 nan\n";
  for (const Case& c : {
           // The first sample stays where it is, whatever comes after it.
           Case{mins, {0, 0, 0}, {2, 2, 2}, mins},
           {mins, {3, 0, 3}, {1, 1, 1}, "axis mins: nan 4 nan\n"},
           {mins + "centers: node node node\n",
            {0, 2, 0},
            {4, 4, 4},
            "axis mins: 0.1 nan nan\ncenters: node node node\n"},
           {"spacings: nan 2 2\n" + mins, {1, 1, 1}, {1, 2, 1}, "spacings: nan 4 2\naxis mins: nan 5 nan\n"},
           {"spacings: nan 2 2\n", {1, 1, 0}, {1, 1, 1}, "spacings: nan 2 2\naxis mins: nan 1 -1\n"},
           {"spacings: nan 2 2\n", {1, 0, 0}, {1, 1, 1}, "spacings: nan 2 2\n"},
           {"space: LPS\nspace origin: (1,2,3)\n",
            {0, 0, 0},
            {2, 2, 2},
            "space: LPS\nspace origin: (1,2,3)\n"},
           {"space: LPS\nspace origin: (1,2,3)\n", {0, 0, 1}, {1, 1, 1}, "space: LPS\n"},
           {"space origin: (nan,nan,nan)\n", {3, 0, 0}, {2, 2, 2}, "space origin: (nan,nan,nan)\n"},
           {"spacings: 1 nan 2\nspace origin: (1,2,3)\n",
            {1, 0, 1},
            {1, 1, 1},
            "spacings: 1 nan 2\nspace origin: (2,2,5)\n"},
       })
    EXPECT_EQ(text_of_region(c.whole, c.low, c.step, 8, 64), c.region) << c.whole;
}

TEST(MetadataOfRegion, AreReadableWhereNumbersBecomeTooLarge) {
  for (const std::string whole :
       {"spacings: 1e308 1 1\n", "spacings: 1e308 1 1\naxis mins: 1e308 0 0\n",
        "space directions: (1e308,0,0) (0,1,0) (0,0,1)\nspace origin: (1e308,0,0)\n"})
    for (const Index3& low : {Index3{0, 0, 0}, Index3{3, 3, 3}})
      for (const std::int64_t step : {1, 4}) {
        const std::string fields = text_of_region(whole, low, {step, step, step}, 8, 64);
        EXPECT_FALSE(has(fields, "inf"));
        EXPECT_NO_THROW(geometry_of(fields)) << fields;
      }
  EXPECT_EQ(text_of_region("spacings: 1e308 1 1\n", {0, 0, 0}, {4, 4, 4}, 8, 64), "spacings: nan 4 4\n");
}

TEST(MetadataOfRegion, SayNothingWhereNothingWasSaid) {
  EXPECT_EQ(text_of_region("", {2, 3, 4}, {2, 2, 2}, 8, 64), "");
  EXPECT_EQ(text_of_region("kVp:=120\n", {2, 3, 4}, {2, 2, 2}, 8, 64), "kVp:=120\n");
}

TEST(MetadataOfRegion, HaveTheEntriesOfTheSlicesThatAreKept) {
  const std::string space =
      "space: LPS\nspace directions: (2,0,0) (0,3,0) (0,0,5)\nspace origin: (10,20,30)\n";
  const std::string whole =
      space + "slice_positions:=10 20 30; 10 20 35; 10 20 41; 10 20 47.5\nslice_slopes:=1 2 3 4\nkVp:=120\n";
  EXPECT_EQ(text_of_region(whole, {0, 0, 0}, {1, 1, 1}, 4, 4), whole);
  EXPECT_EQ(text_of_region(whole, {0, 0, 0}, {1, 1, 1}, 3, 4),
            space + "slice_positions:=10 20 30; 10 20 35; 10 20 41\nslice_slopes:=1 2 3\nkVp:=120\n");
  // The first slice lies where its own position says, not where equal steps would put it.
  EXPECT_EQ(text_of_region(whole, {1, 2, 1}, {1, 1, 1}, 3, 4),
            "space: LPS\nspace directions: (2,0,0) (0,3,0) (0,0,5)\nspace origin: (12,26,35)\n"
            "slice_positions:=12 26 35; 12 26 41; 12 26 47.5\nslice_slopes:=2 3 4\nkVp:=120\n");
  // The same rule holds for any list with as many entries as slices, and for no other text.
  const std::string lists =
      "slice_sop_instance_uids:=1.2 1.3 1.4\nslice_times:=7 8 9\ndicom_added_intercept:=-1 -2 -3\n"
      "slice_thickness:=3\nslice_note:=two words\n";
  EXPECT_EQ(text_of_region(lists, {0, 0, 1}, {1, 1, 1}, 2, 3),
            "slice_sop_instance_uids:=1.3 1.4\nslice_times:=8 9\ndicom_added_intercept:=-2 -3\n"
            "slice_thickness:=3\nslice_note:=two words\n");
  EXPECT_EQ(text_of_region(lists, {0, 0, 0}, {2, 2, 2}, 2, 3).substr(0, 32),
            "slice_sop_instance_uids:=1.2 1.4");
  EXPECT_EQ(text_of_region(lists, {1, 1, 0}, {1, 1, 1}, 3, 3), lists);
  for (const std::int64_t all : {1, 3, 4})
    EXPECT_EQ(text_of_region("slice_slopes:=1 2\n", {0, 0, 0}, {1, 1, 1}, 1, all), "")
        << "too few, or too many";
}

TEST(MetadataOfRegion, HaveADirectionWhereSlicesLieAtEqualDistances) {
  const std::string axes = "space: LPS\nspace directions: (2,0,0) (0,3,0) ",
                    whole = axes +
                            "(0,0,5)\nspace origin: (10,20,30)\n"
                            "slice_positions:=10 20 30; 10 20 35; 10 20 40; 10 21 46; 10 22 52\n";
  EXPECT_EQ(text_of_region(whole, {0, 0, 0}, {1, 1, 1}, 3, 5), axes + "(0,0,5)\nspace origin: (10,20,30)\n");
  EXPECT_EQ(text_of_region(whole, {1, 0, 2}, {1, 1, 1}, 3, 5), axes + "(0,1,6)\nspace origin: (12,20,40)\n");
  EXPECT_EQ(text_of_region(whole, {0, 0, 3}, {1, 1, 1}, 1, 5), axes + "(0,0,5)\nspace origin: (10,21,46)\n");
  EXPECT_EQ(text_of_region(whole, {0, 0, 0}, {2, 2, 2}, 2, 5),
            "space: LPS\nspace directions: (4,0,0) (0,6,0) (0,0,10)\nspace origin: (10,20,30)\n");
  // Directions must span a volume.
  const std::string flat = axes + "(0,0,5)\nspace origin: (0,0,0)\nslice_positions:=0 0 1; 0 0 1; 0 0 9\n";
  EXPECT_NO_THROW(geometry_of(text_of_region(flat, {0, 0, 0}, {1, 1, 1}, 2, 3)));
}

}  // namespace
}  // namespace tagrid
