// Slopes and intercepts in the description of a volume.
#include "io/metadata/rescale.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "io/metadata/text.h"

namespace tagrid {
namespace {

Rescale rescale_of(const std::string& text) { return parse_metadata(text).rescale(); }
std::string text_of_values(const std::string& text) {
  return text_of(metadata_of_values(parse_metadata(text)));
}

TEST(Rescaling, IsThatWhichWasAdded) {
  for (const Rescale& rescale : {Rescale{2, -1000, "HU"}, {-0.1, 3, ""}, {1, 0.5, "g/cm3"}}) {
    KeyValues pairs;
    add_rescale(rescale, pairs);
    EXPECT_EQ(Metadata(Geometry(), pairs).rescale(), rescale);
  }
}

TEST(Rescaling, IsNoneIfThereIsNoneOrItIsNotNumbers) {
  EXPECT_EQ(rescale_of(""), Rescale{});
  EXPECT_EQ(rescale_of("rescale_units:=HU\n"), (Rescale{1, 0, "HU"}));
  // Of equal keys, the last one counts, for all who ask.
  const std::string twice = "rescale_slope:=5\nrescale_slope:=2\n";
  EXPECT_EQ(rescale_of(twice), (Rescale{2, 0, ""}));
  EXPECT_EQ(parse_metadata(twice).text_of("rescale_slope"), "2");
  for (const char* fields :
       {"rescale_slope:=0\nrescale_intercept:=5\n", "rescale_slope:=nan\n", "rescale_slope:=x\n",
        "rescale_slope:=2\nrescale_intercept:=inf\n", "rescale_slope:=2\nrescale_intercept:=x\n",
        "rescale_slope:=2\nslice_slopes:=2 3\n"})
    EXPECT_EQ(rescale_of(fields), Rescale{}) << fields;
}

TEST(Rescaling, IsInDoubtIfItIsThereAndNoNumber) {
  for (const char* fields : {"", "rescale_slope:=0\n", "rescale_slope:=2\nrescale_intercept:=-1e3\n",
                             "slice_slopes:=1 2 3\nslice_intercepts:=0 0 0\n", "who:=x\n"})
    EXPECT_EQ(doubt_of_rescale(parse_metadata(fields), 3), "") << fields;
  for (const char* fields :
       {"rescale_slope:=\n", "rescale_slope:=x\n", "rescale_intercept:=inf\n", "rescale_slope:=2,5\n",
        "slice_slopes:=1 2\n", "slice_slopes:=1 2 x\n", "slice_intercepts:=1 2 nan\n"})
    EXPECT_NE(doubt_of_rescale(parse_metadata(fields), 3), "") << fields;
}

TEST(Rescaling, OfSlicesHasANumberForEach) {
  const auto own = rescale_of_slices(parse_metadata("slice_slopes:=1 -2.5\nslice_intercepts:=0 7\n"), 2);
  ASSERT_TRUE(own);
  EXPECT_EQ(own->slopes, (std::vector{1, -2.5}));
  EXPECT_EQ(own->intercepts, (std::vector{0.0, 7.0}));
  EXPECT_EQ(rescale_of_slices(parse_metadata("slice_slopes:=1 2\n"), 2)->intercepts, (std::vector{0.0, 0.0}));
  for (const char* fields : {"", "slice_slopes:=1\n", "slice_slopes:=1 x\n", "slice_slopes:=1 inf\n",
                             "slice_slopes:=1 2\nslice_intercepts:=1\n"})
    EXPECT_FALSE(rescale_of_slices(parse_metadata(fields), 2)) << fields;
}

TEST(Rescaling, WhatWasAppliedIsToldAndCountsNoLonger) {
  EXPECT_EQ(
      text_of_values("content: x\nrescale_slope:=1\nrescale_intercept:=-1024\nrescale_units:=HU\nmin: 0\n"),
      "content: x\nrescale_units:=HU\napplied_intercept:=-1024\n");
  EXPECT_EQ(text_of_values("rescale_slope:=2\nrescale_intercept:=0\nvdb_background:=5\n"),
            "vdb_background:=10\napplied_slope:=2\napplied_intercept:=0\n");
  // Twice.
  EXPECT_EQ(text_of_values("applied_intercept:=-1024\nrescale_slope:=2\nrescale_intercept:=1\n"),
            "applied_slope:=2\napplied_intercept:=-2047\n");
  EXPECT_EQ(text_of_values("slice_slopes:=1 2\nslice_intercepts:=3 4\nrescale_slope:=2\n"),
            "slice_applied_slopes:=1 2\nslice_applied_intercepts:=3 4\n");
  EXPECT_EQ(rescale_of(text_of_values("rescale_slope:=2\nrescale_intercept:=9\n")), Rescale{});
}

}  // namespace
}  // namespace tagrid
