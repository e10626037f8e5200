// NRRD: headers of others.
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
  EXPECT_EQ(parse_nrrd_header(half.text).info.metadata.rescale(), Rescale{});
  EXPECT_EQ(foreign_nrrd_header(plain_header + "old min: 0\nold max: 5\n").not_understood.size(), 2U);
}

}  // namespace
}  // namespace tagrid
