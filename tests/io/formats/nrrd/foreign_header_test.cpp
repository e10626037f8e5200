// NRRD: headers of others, and slopes and intercepts.
#include <gtest/gtest.h>

#include <map>

#include "io/formats/nrrd/header.h"
#include "io/metadata/rescale.h"

namespace tagrid {
namespace {

const std::string plain_header =
    "NRRD0005\ntype: short\ndimension: 3\nsizes: 3 4 5\nencoding: raw\nendian: little\n";

TEST(ForeignNrrdHeader, WhatCanBeReadStaysByteForByte) {
  for (const std::string fields :
       {"spacings: 0.5 nan 2\r\n", "space: LPS\nspace directions: (1,0,0) (0, 1 ,0) (0,0,-2)\n",
        "# spacings: x\nrescale_slope:=2\nwho:=nobody, 2,5\n", "space origin: (nan,nan,nan)\n",
        "data file: LIST\nspacings: x\n", "space directions: (1,0,0) (0,1,0) none\n"}) {
    const ForeignNrrdHeader header = foreign_nrrd_header(plain_header + fields);
    EXPECT_EQ(header.text, plain_header + fields);
    EXPECT_TRUE(header.warnings.empty() && header.not_understood.empty()) << fields;
  }
}

TEST(ForeignNrrdHeader, WhatCannotBeReadIsUnknownAndSaid) {
  const std::map<std::string, std::string> changed = {
      {"spacings: 0.5 inf 2\n", "spacings: 0.5 nan 2\n"},
      {"spacings: 0,5 0 2,25\n", "spacings: 0.5 nan 2.25\n"},
      {"spacings: 1 1\n", "# spacings: 1 1\n"},
      {"thicknesses: x 1 1\n", "thicknesses: nan 1 1\n"},
      {"axis mins: 0 1,5 x\n", "axis mins: 0 1.5 nan\n"},
      {"space directions: (2,0,0) (4,0,0) (0,0,0)\n", "spacings: 2 4 nan\n"},
      {"spacings: 1 2 3\nspace directions: (2,0,0) (4,0,0) (0,0,1)\n",
       "spacings: 1 2 3\n# space directions: (2,0,0) (4,0,0) (0,0,1)\n"},
      {"space directions: (1,0,0) (0,inf,0) (0,0,1)\n", "# space directions: (1,0,0) (0,inf,0) (0,0,1)\n"},
      {"space directions: (1,0,0) (0,1,0)\n", "# space directions: (1,0,0) (0,1,0)\n"},
      {"space directions: (1,0,0) (0,1,0\n", "# space directions: (1,0,0) (0,1,0\n"},
      {"space origin: (1,nan,3)\n", "# space origin: (1,nan,3)\n"},
      {"space origin: (1,2)\n", "# space origin: (1,2)\n"},
      {"block size: 4\n", "# block size: 4\n"},
      {"rescale_slope:=2,50\nrescale_intercept:=-1\n", "rescale_slope:=2.5\nrescale_intercept:=-1\n"}};
  for (const auto& [fields, wanted] : changed) {
    const ForeignNrrdHeader header = foreign_nrrd_header(plain_header + fields);
    EXPECT_EQ(header.text, plain_header + wanted);
    EXPECT_FALSE(header.warnings.empty()) << fields;
    EXPECT_NO_THROW(parse_nrrd_header(header.text)) << header.text;
    // Nothing is unusual about what was made of it.
    EXPECT_EQ(foreign_nrrd_header(header.text).text, header.text);
  }
}

TEST(ForeignNrrdHeader, AScaleThatCannotBeReadStaysInDoubt) {
  for (const std::string fields : {"rescale_slope:=\n", "rescale_slope:=1,024\n", "rescale_intercept:=nan\n"})
    EXPECT_NE(
        doubt_of_rescale(parse_nrrd_header(foreign_nrrd_header(plain_header + fields).text).info.metadata, 5),
        "")
        << fields;
  EXPECT_EQ(foreign_nrrd_header(plain_header + "slice_positions:=0 0 1; 0 x 2\n").warnings.size(), 1U);
  const ForeignNrrdHeader half =
      foreign_nrrd_header(plain_header + "rescale_slope:=2\nrescale_intercept:=x\n");
  EXPECT_EQ(rescale_of(parse_nrrd_header(half.text).info.metadata), Rescale{});
  EXPECT_EQ(foreign_nrrd_header(plain_header + "old min: 0\nold max: 5\n").not_understood.size(), 2U);
}
TEST(Rescaling, IsThatWhichWasAdded) {
  for (const Rescale& rescale : {Rescale{2, -1000, "HU"}, {-0.1, 3, ""}, {1, 0.5, "g/cm3"}}) {
    KeyValues pairs;
    add_rescale(rescale, pairs);
    EXPECT_EQ(rescale_of(Metadata({}, pairs)), rescale);
  }
}

TEST(Rescaling, IsNoneIfThereIsNoneOrItIsNotNumbers) {
  EXPECT_EQ(rescale_of(""), Rescale{});
  EXPECT_EQ(rescale_of("rescale_units:=HU\n"), (Rescale{1, 0, "HU"}));
  // Of equal keys, the last one counts, for all who ask.
  const std::string twice = "rescale_slope:=5\nrescale_slope:=2\n";
  EXPECT_EQ(rescale_of(twice), (Rescale{2, 0, ""}));
  EXPECT_EQ(text_of_key(twice, "rescale_slope"), "2");
  for (const char* fields :
       {"rescale_slope:=0\nrescale_intercept:=5\n", "rescale_slope:=nan\n", "rescale_slope:=x\n",
        "rescale_slope:=2\nrescale_intercept:=inf\n", "rescale_slope:=2\nrescale_intercept:=x\n",
        "rescale_slope:=2\nslice_slopes:=2 3\n"})
    EXPECT_EQ(rescale_of(fields), Rescale{}) << fields;
}

TEST(Rescaling, IsInDoubtIfItIsThereAndNoNumber) {
  for (const char* fields : {"", "rescale_slope:=0\n", "rescale_slope:=2\nrescale_intercept:=-1e3\n",
                             "slice_slopes:=1 2 3\nslice_intercepts:=0 0 0\n", "who:=x\n"})
    EXPECT_EQ(doubt_of_rescale(fields, 3), "") << fields;
  for (const char* fields :
       {"rescale_slope:=\n", "rescale_slope:=x\n", "rescale_intercept:=inf\n", "rescale_slope:=2,5\n",
        "slice_slopes:=1 2\n", "slice_slopes:=1 2 x\n", "slice_intercepts:=1 2 nan\n"})
    EXPECT_NE(doubt_of_rescale(fields, 3), "") << fields;
}

TEST(Rescaling, OfSlicesHasANumberForEach) {
  const auto own = rescale_of_slices("slice_slopes:=1 -2.5\nslice_intercepts:=0 7\n", 2);
  ASSERT_TRUE(own);
  EXPECT_EQ(own->slopes, (std::vector{1, -2.5}));
  EXPECT_EQ(own->intercepts, (std::vector{0.0, 7.0}));
  EXPECT_EQ(rescale_of_slices("slice_slopes:=1 2\n", 2)->intercepts, (std::vector{0.0, 0.0}));
  for (const char* fields : {"", "slice_slopes:=1\n", "slice_slopes:=1 x\n", "slice_slopes:=1 inf\n",
                             "slice_slopes:=1 2\nslice_intercepts:=1\n"})
    EXPECT_FALSE(rescale_of_slices(fields, 2)) << fields;
}

TEST(Rescaling, WhatWasAppliedIsToldAndCountsNoLonger) {
  EXPECT_EQ(metadata_of_values(
                "content: x\nrescale_slope:=1\nrescale_intercept:=-1024\nrescale_units:=HU\nmin: 0\n"),
            "content: x\nrescale_units:=HU\napplied_intercept:=-1024\n");
  EXPECT_EQ(metadata_of_values("rescale_slope:=2\nrescale_intercept:=0\nvdb_background:=5\n"),
            "vdb_background:=10\napplied_slope:=2\napplied_intercept:=0\n");
  // Twice.
  EXPECT_EQ(metadata_of_values("applied_intercept:=-1024\nrescale_slope:=2\nrescale_intercept:=1\n"),
            "applied_slope:=2\napplied_intercept:=-2047\n");
  EXPECT_EQ(metadata_of_values("slice_slopes:=1 2\nslice_intercepts:=3 4\nrescale_slope:=2\n"),
            "slice_applied_slopes:=1 2\nslice_applied_intercepts:=3 4\n");
  EXPECT_EQ(rescale_of(metadata_of_values("rescale_slope:=2\nrescale_intercept:=9\n")), Rescale{});
}

}  // namespace
}  // namespace tagrid
