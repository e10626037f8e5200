// The description of a volume: its text comes back, and what is typed is what the text says.
#include "io/metadata/metadata.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "io/errors/errors.h"
#include "tests/support/metadata.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

TEST(MetadataTest, TextComesBackByteForByte) {
  for (const std::string text :
       {"", "# only a remark\n", "#\n#\n", "Spacings:1  2\t3 \ncontent:\nAxisMins: 1 2 3\n",
        "a:b key:=type: 3\nkey:=\n:=no name\nkey:=again\\n\n", "who:=\xff\xfe\n"}) {
    const Metadata metadata = parse_metadata(text);
    EXPECT_EQ(text_of(metadata), text);
    EXPECT_EQ(text_of(Metadata(metadata.entries())), text);
  }
}

TEST(MetadataTest, EntriesHaveTheirPartsInOrder) {
  const Metadata metadata = parse_metadata("# a: b\nAxisMins:\t1 2 3 \na:b:=c:=d \n");
  std::vector<MetadataEntry> entries;
  for (const MetadataEntry& entry : metadata.entries()) entries.push_back(entry);
  ASSERT_EQ(entries.size(), 3U);
  EXPECT_EQ(entries[0].kind, MetadataEntry::Kind::comment);
  EXPECT_EQ(entries[0].line, "# a: b");
  EXPECT_EQ(entries[1].kind, MetadataEntry::Kind::field);
  EXPECT_EQ(entries[1].field, "axis mins");
  EXPECT_EQ(entries[1].value, "1 2 3");
  EXPECT_EQ(entries[2].kind, MetadataEntry::Kind::pair);
  EXPECT_EQ(entries[2].key, "a:b");
  EXPECT_EQ(entries[2].value, "c:=d ");
}

TEST(MetadataTest, OfEqualKeysTheLastOneCountsAtThePlaceOfTheFirst) {
  Metadata metadata = parse_metadata("a:=1\nb:=2\na:=3\\n4\n");
  EXPECT_EQ(metadata.value("a"), "3\n4");
  EXPECT_EQ(metadata.value("c"), std::nullopt);
  EXPECT_EQ(metadata.text_of("c"), "");
  EXPECT_EQ(metadata.pairs(), (KeyValues{{"a", "3\n4"}, {"b", "2"}}));
  metadata.erase("a");
  EXPECT_EQ(text_of(metadata), "b:=2\n");
}

TEST(MetadataTest, WhatIsTypedFollowsEveryChange) {
  Metadata metadata = parse_metadata("spacings: 1 2 3\n");
  metadata.add_pairs({{"rescale_slope", "2"}, {"rescale_intercept", "-1000"}});
  EXPECT_EQ(metadata.rescale(), (Rescale{2, -1000, ""}));
  metadata.add_written_pair("slice_slopes", "1 -5 x inf");
  EXPECT_EQ(metadata.rescale(), Rescale{});
  EXPECT_EQ(metadata.rescale_of_bounds(), (Rescale{5, 0, ""}));
  metadata.erase("slice_slopes");
  EXPECT_EQ(metadata.largest_slope(), 2);
  EXPECT_EQ(metadata.geometry().spacing, (std::array{1.0, 2.0, 3.0}));
  EXPECT_EQ(text_of(metadata), "spacings: 1 2 3\nrescale_slope:=2\nrescale_intercept:=-1000\n");
}

TEST(MetadataTest, KeysAndTextsBecomeOneLineEach) {
  const KeyValues pairs = {{"#a:=b", "two\nlines \\n\r"}, {"", "spacings: 1 1 1"}};
  const Metadata metadata(Geometry(), pairs);
  EXPECT_EQ(text_of(metadata), "_a__b:=two\\nlines \\\\n\n_:=spacings: 1 1 1\n");
  EXPECT_EQ(metadata.value("_a__b"), "two\nlines \\n");
  EXPECT_EQ(parse_metadata(text_of(metadata)), metadata);
  Metadata other;
  EXPECT_THROW(other.add_written_pair("a", "b\nc"), BrokenInput);
  Geometry geometry;
  geometry.has_origin = true;
  geometry.space = "a\nsizes: 1 2 3";
  EXPECT_THROW(Metadata{geometry}, BrokenInput);
}

TEST(MetadataTest, LinesEndWithALineFeed) {
  for (const std::string text : {"content: x", "content: x\r\n", "content: x\n\n", "no field\n"})
    EXPECT_THROW(parse_metadata(text), BrokenInput) << text;
}

TEST(MetadataTest, StrippedKeepsWhatSamplesNeed) {
  EXPECT_EQ(text_of(stripped(parse_metadata(
                "# by hand\ncontent: x\nspacings: 1 1 1\nwho:=me\nrescale_slope:=2\nvdb_grid:=a\n"))),
            "spacings: 1 1 1\nrescale_slope:=2\nvdb_grid:=a\n");
}

RC_GTEST_PROP(MetadataTest, AnyTextComesBackOrIsRefused, ()) {
  const std::vector<std::string> pieces = {"\n",          "\n",      ":",
                                           ":=",          "#",       "content",
                                           "spacings: ",  "1 2 3",   "space origin: ",
                                           "(1,2,3)",     "key",     "axis mins: ",
                                           "nan",         "\r",      std::string(1, '\0'),
                                           "units: ",     "\"mm\" ", "rescale_slope",
                                           "slice_slopes"};
  std::string text;
  for (const auto& part : *rc::gen::container<std::vector<std::string>>(rc::gen::elementOf(pieces)))
    text += part;
  text += *rc::gen::element<std::string>("", "\n");
  try {
    const Metadata metadata = parse_metadata(text);
    RC_ASSERT(text_of(metadata) == text);
    for (const auto& [key, value] : metadata.pairs()) RC_ASSERT(metadata.value(key) == value);
    RC_ASSERT(text_of(Metadata(metadata.entries())) == text);
  } catch (const BrokenInput&) {
  }
}

TEST(MetadataTest, UnknownSpacingCountsAsOne) {
  const Geometry geometry = geometry_of("spacings: 0.5 NaN 2\n");
  EXPECT_TRUE(std::isnan(geometry.spacing[1]));
  EXPECT_EQ(to_world(geometry, Index3{1, 1, 1}), (std::array<double, 3>{0.5, 1, 2}));
  EXPECT_FALSE(is_mirrored(geometry));
  EXPECT_EQ(to_world(geometry_of(""), Index3{7, 8, 9}), (std::array<double, 3>{7, 8, 9}));
}

TEST(MetadataTest, AxisMinsAreTheEdgeOfTheFirstSampleUnlessItIsAPoint) {
  EXPECT_EQ(geometry_of("spacings: 2 2 2\naxis mins: 1 2 3\ncenters: cell node ???\n").origin,
            (std::array<double, 3>{2, 2, 4}));
}

TEST(MetadataTest, SpacingsReadBackExactly) {
  Geometry geometry;
  geometry.has_spacing = true;
  geometry.spacing = {0.4882812, 1.0 / 3, 4e-300};
  EXPECT_EQ(Metadata(geometry).geometry().spacing, geometry.spacing);
  geometry.spacing = {1, 1, 1.4};
  EXPECT_EQ(text_of(Metadata(geometry)), "spacings: 1 1 1.4\n");
}

TEST(MetadataTest, AnOriginOfNansIsNotKnown) {
  for (const std::string fields : {"space: LPS\nspace origin: (nan,NaN,nan)\n", "axis mins: nan nan nan\n"}) {
    EXPECT_FALSE(geometry_of(fields).has_origin) << fields;
    EXPECT_EQ(geometry_of(fields).origin[0], 0) << fields;
  }
  EXPECT_TRUE(geometry_of("axis mins: nan 2 nan\n").has_origin);
  EXPECT_THROW(geometry_of("space: LPS\nspace origin: (nan,1,nan)\n"), BrokenInput);
  EXPECT_THROW(geometry_of("space: LPS\nspace origin: (1,nan,1)\n"), BrokenInput);
  // Axes that are none of space, which others write as "none".
  const std::string none = message_of<BrokenInput>(
      [] { geometry_of("space: LPS\nspace directions: (1,0,0) (0,1,0) (nan,nan,nan)\n"); });
  EXPECT_TRUE(has(none, "each of the three axes must be one of space"));
}

TEST(MetadataTest, StorageFieldsAreNoFieldsOfTheVolume) {
  EXPECT_THROW(geometry_of("sizes: 1 2 3\n"), BrokenInput);
  EXPECT_THROW(geometry_of("content: x\n\nsecret\n"), BrokenInput);
}

}  // namespace
}  // namespace tagrid
