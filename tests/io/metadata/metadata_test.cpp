// The description of a volume: its text comes back, and what is typed is what the text says.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "io/errors/errors.h"
#include "io/metadata/metadata.h"
#include "io/metadata/region.h"
#include "io/metadata/rescale.h"
#include "io/metadata/text.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

Geometry geometry_of(const std::string& text) { return parse_metadata(text).geometry(); }

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
  EXPECT_EQ(
      text_of(stripped(parse_metadata("# by hand\ncontent: x\nspacings: 1 1 "
                                      "1\nwho:=me\nrescale_slope:=2\nvdb_grid:=a\nvdb_origin:=1 2 3\n"))),
      "spacings: 1 1 1\nrescale_slope:=2\nvdb_origin:=1 2 3\n");
}

TEST(MetadataTest, StrippedKeepsNoTextOfAHeader) {
  EXPECT_EQ(text_of(stripped(parse_metadata(
                "rescale_slope:=Zwiebel 2\nlossy source:=JPEG of Zwiebel\napplied_zwiebel:=1\n"
                "scale doubt:=Zwiebel\nnot understood:=b/Zwiebel.edf; c\nvdb_grid:=Zwiebel\n"))),
            "rescale_slope:=unknown\nlossy source:=an earlier compression\n"
            "scale doubt:=what values samples mean is in doubt\n"
            "not understood:=its reader did not understand all of it\n");
}

TEST(MetadataTest, StrippedKeepsOnlyKnownUnitsAndSpaces) {
  EXPECT_EQ(
      text_of(stripped(parse_metadata(
          "spacings: 1 2 nan\nthicknesses: Zwiebel\nmin: 3\nmax: Zwiebel\nlabels: \"Zwiebel\" \"y\" \"z\"\n"
          "units: \"mm\" \"Zwiebel\" \"mm\"\nsample units: Zwiebel\ncenters: cell cell Zwiebel\nblock size: "
          "3\n"
          "measurement frame: (1,0,0) (0,Zwiebel,0) (0,0,1)\nrescale_units:=Zwiebel\n"
          "given spacing:=1 2 Zwiebel\noverridden spacing:=1 2 nan Zwiebel Adelgunde\n"))),
      "spacings: 1 2 nan\nmin: 3\nblock size: 3\noverridden spacing:=1 2 nan\n");
  const std::string geometry =
      "space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (1,2,3)\n"
      "measurement frame: (1,0,0) (0,1,0) (0,0,1)\n";
  EXPECT_EQ(text_of(stripped(parse_metadata("space: Zwiebel\n" + geometry))),
            "space dimension: 3\n" + geometry);
  const std::string harmless =
      "space: Left-Posterior-Superior\nspace units: \"mm\" \"mm\" \"micron\"\n" + geometry +
      "kinds: domain domain space\ncenters: cell node ???\nrescale_units:=g/cm\xc2\xb3\n"
      "given spacing:=1 2 nan um\n";
  EXPECT_EQ(text_of(stripped(parse_metadata(harmless))), harmless);
  for (const std::string unit :
       {"HU", "1/mm", "g/cm^3", "Bq/ml", "mg cm-3", "10^-6 mm\xc2\xb2/s", "%", "BQML"}) {
    const std::string text = "rescale_units:=" + unit + "\n";
    EXPECT_EQ(text_of(stripped(parse_metadata(text))), text);
  }
}

TEST(MetadataTest, DoubtsNameNoFile) {
  const NamesOfSource names =
      names_of_source({"data/Zwiebel/Knie"}, {"data/Zwiebel/Knie/a 1.edf", "data/Zwiebel/Knie/b.edf"});
  Metadata metadata;
  add_doubts("data/Zwiebel/Knie/b.edf: has no slope, unlike data/Zwiebel/Knie/a 1.edf in data/Zwiebel",
             {"data/Zwiebel/Knie: b.edf is odd", "b.edf: grab.edf and data/Zwiebel/other.raw"}, names,
             metadata);
  EXPECT_EQ(metadata.text_of(scale_doubt_key), "has no slope, unlike a file in its directory");
  EXPECT_EQ(metadata.text_of(not_understood_key), "a file is odd; grab.edf and other.raw");
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

// The description of a region: its samples have the same positions as in the whole volume.

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

// Slopes and intercepts in the description of a volume.

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
