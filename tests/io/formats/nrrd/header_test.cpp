#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <fmt/format.h>
#include <cmath>
#include <map>
#include <sstream>

#include "io/errors/errors.h"
#include "io/formats/nrrd/header.h"
#include "io/metadata/rescale.h"
#include "io/metadata/text.h"
#include "tests/support/temporary_folder.h"

namespace tagrid {
namespace {

const std::string plain =
    "NRRD0004\ntype: int16\ndimension: 3\nsizes: 3 4 5\nencoding: raw\nendian: little\n";

const std::string everything =
    "# made by a scanner: of some kind\n"
    "content: a foot\n"
    "Space: left-posterior-superior\n"
    "space directions: (0.5,0,0) (0, 0.5 ,0) (0,0,-2)\n"
    "space origin: (10,20,-30.5)\n"
    "space units: \"mm\" \"mm\" \"mm\"\n"
    "thicknesses: nan nan 1.5\n"
    "kinds: domain domain domain\n"
    "sample units: HU\n"
    "patient:=none: a phantom\n"
    "a:b key:=type: 3\n"
    "measurement frame: (1,0,0) (0,1,0) (0,0,1)\n";

TEST(NrrdHeader, FieldsOfTheSourceComeBackAsTheyWere) {
  const NrrdHeader header = parse_nrrd_header(plain + everything + "\n");
  EXPECT_EQ(text_of(header.info.metadata), everything);
  const std::string text = nrrd_header_text(header.info, "x.raw");
  EXPECT_TRUE(text.starts_with("NRRD0005\n"));
  const NrrdHeader again = parse_nrrd_header(text);
  EXPECT_EQ(text_of(again.info.metadata), everything);
  EXPECT_EQ(again.info.dims, header.info.dims);
  EXPECT_EQ(again.info.type, header.info.type);
  EXPECT_EQ(again.data_files, std::vector<std::string>{"x.raw"});
}

TEST(NrrdHeader, GeometryHasDirectionsAndOrigin) {
  const Geometry geometry = parse_nrrd_header(plain + everything).info.geometry();
  EXPECT_TRUE(geometry.has_directions);
  EXPECT_EQ(geometry.spacing, (std::array<double, 3>{0.5, 0.5, 2}));
  EXPECT_EQ(to_world(geometry, Index3{2, 4, 3}), (std::array<double, 3>{11, 22, -36.5}));
  EXPECT_TRUE(is_mirrored(geometry));
}

TEST(NrrdHeader, EverySpellingOfATypeIsKnown) {
  const std::pair<SampleType, std::vector<std::string>> spellings[] = {
      {SampleType::int8, {"signed char", "int8", "int8_t"}},
      {SampleType::uint8, {"uchar", "unsigned char", "uint8", "uint8_t"}},
      {SampleType::int16, {"short", "short int", "signed short", "signed short int", "int16", "int16_t"}},
      {SampleType::uint16,
       {"ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t", "UNSIGNED  Short"}},
      {SampleType::int32, {"int", "signed int", "int32", "int32_t"}},
      {SampleType::uint32, {"uint", "unsigned int", "uint32", "uint32_t"}},
      {SampleType::float32, {"float"}},
      {SampleType::float64, {"double"}}};
  for (const auto& [type, names] : spellings)
    for (const std::string& name : names)
      EXPECT_EQ(parse_nrrd_header("NRRD0001\ntype: " + name +
                                  "\ndimension: 3\nsizes: 1 1 1\nencoding: raw\nendian: big\n")
                    .info.type,
                type)
          << name;
}

TEST(NrrdHeader, LineEndsAndCaseAndShortSpellingsDoNotMatter) {
  const NrrdHeader header = parse_nrrd_header(
      "NRRD0003\r\nTYPE: short\r\nDimension: 3\r\nsizes:  3 4\t5 \r\nEncoding: GZ\r\nEndian: Big\r\n"
      "datafile: a b%d.raw\r\nlineskip: 2\r\nbyteskip: 7\r\ncontent: x\r\n");
  EXPECT_EQ(header.info.dims, (Index3{3, 4, 5}));
  EXPECT_EQ(header.encoding, NrrdHeader::Encoding::gzip);
  EXPECT_TRUE(header.big_endian);
  EXPECT_EQ(header.data_files, std::vector<std::string>{"a b%d.raw"});
  EXPECT_EQ(header.line_skip, 2);
  EXPECT_EQ(header.byte_skip, 7);
  EXPECT_EQ(text_of(header.info.metadata), "content: x\n");
}

TEST(NrrdHeader, WhatIsNotSupportedIsRefusedByName) {
  const std::string magic = "NRRD0004\n", type = "type: short\n", shape = "dimension: 3\nsizes: 3 4 5\n",
                    storage = "encoding: raw\nendian: little\n";
  const std::map<std::string, std::string> broken = {
      {"NRRD0006\n" + type + shape + storage, "NRRD0006"},
      {magic + shape + storage, "\"type\" is missing"},
      {magic + "type: block\n" + shape + storage, "block"},
      {magic + "type: int64\n" + shape + storage, "int64"},
      {magic + type + "dimension: 4\nsizes: 2 3 4 5\n" + storage,
       "a volume has 3 axes, and this file has 4 with more than one sample"},
      {magic + type + "dimension: 1\nsizes: 3\n" + storage, "has 2 to 16 axes"},
      {magic + type + "dimension: 17\nsizes: 3\n" + storage, "has 2 to 16 axes"},
      {magic + type + "dimension: 4\nsizes: 1 3 4 0\n" + storage, "positive"},
      {magic + type + "dimension: 4\nsizes: 1 3 4 5\nspacings: 1 1 1\n" + storage,
       "a value for each of the 4 axes"},
      {magic + type + "dimension: 2\nsizes: 3 4\nlabels: \"x\n" + storage, "a value for each of the 2 axes"},
      {magic + type + "dimension: 4\nsizes: 1 3 4 5\nspace directions: (1,0,0) (0,1,0) (0,0,1) none\n" +
           storage,
       "none"},
      {magic + type + "dimension: 3\nsizes: 3 4\n" + storage, "3 numbers"},
      {magic + type + "dimension: 3\nsizes: 3 4 5x\n" + storage, "5x"},
      {magic + type + "dimension: 3\nsizes: 3 0 5\n" + storage, "positive"},
      {magic + type + "dimension: 3\nsizes: 3 -4 5\n" + storage, "positive"},
      {magic + type + "dimension: 3\nsizes: 4294967296 4294967296 4294967296\n" + storage, "2^62"},
      {magic + type + "dimension: 3\nsizes: 3 4 99999999999999999999\n" + storage, "whole number"},
      {magic + type + shape + "encoding: raw\n", "\"endian\" is missing"},
      {magic + type + shape + "encoding: hex\nendian: little\n", "raw, gzip or bzip2"},
      {magic + type + shape + "encoding: raw\nendian: middle\n", "little or big"},
      {magic + type + shape + storage + "type: short\n", "twice"},
      {magic + type + shape + storage + "spacings: 1 1 1\nspacings: 1 1 1\n", "twice"},
      {magic + type + shape + storage + "spacings: 1 0 1\n", "spacing is 0"},
      {magic + type + shape + storage + "spacings: 1 1\n", "3 numbers"},
      {magic + type + shape + storage + "space directions: (1,0,0) (0,1,0) none\n", "none"},
      {magic + type + shape + storage + "space directions: (1,0,0) (0,1,0) (1,1,0)\n", "span"},
      {magic + type + shape + storage + "space directions: (1,0) (0,1) (1,1)\n", "vector"},
      {magic + type + shape + storage + "space: LPST\n", "four dimensions"},
      {magic + type + shape + storage + "byte skip: -2\n", "byte skip"},
      {magic + type + shape + storage + "line skip: -1\n", "line skip"},
      {magic + type + shape + "encoding: gzip\nendian: little\nbyte skip: -1\n", "byte skip"},
      {magic + type + shape + storage + "what is this\n", "what is this"}};
  for (const auto& [text, says] : broken) {
    const std::string message = message_of<BrokenInput>([&text = text] { parse_nrrd_header(text); });
    EXPECT_TRUE(has(message, says)) << message << "\n" << text;
  }
}

TEST(NrrdHeader, OnlyAxesOfPositionsMakeAVolume) {
  for (const std::string kinds :
       {"domain domain domain", "space space space", "none ??? Domain", "??? ??? ???"})
    EXPECT_NO_THROW(parse_nrrd_header(plain + "kinds: " + kinds + "\n")) << kinds;
  for (const std::string kind :
       {"RGB-color", "rgb-color",        "3-color",    "HSV-color",           "RGBA-color", "vector",
        "3-vector",  "covariant-vector", "normal",     "3-gradient",          "list",       "point",
        "complex",   "2-vector",         "quaternion", "3D-symmetric-matrix", "time",       "stub",
        "scalar",    "unheard-of"})
    for (const std::string& kinds :
         {kind + " domain domain", "space " + kind + " space", "none none " + kind}) {
      const std::string message =
          message_of<BrokenInput>([&] { parse_nrrd_header(plain + "kinds: " + kinds + "\n"); });
      EXPECT_TRUE(has(message, "has kind \"" + kind + "\""));
      EXPECT_TRUE(has(message, "not a volume of single values"));
    }
  const std::string four =
      message_of<BrokenInput>([] { parse_nrrd_header(plain + "kinds: RGB-color domain domain domain\n"); });
  EXPECT_TRUE(has(four, "must be 3 words"));
}

NrrdHeader header_of(const std::string& axes) {
  return parse_nrrd_header("NRRD0005\ntype: uint8\nencoding: raw\n" + axes);
}

TEST(NrrdHeader, AnAxisOfOneSampleIsLeftOut) {
  for (const auto& [fields, left] : {std::pair{"dimension: 4\nsizes: 1 3 4 5\n", 0},
                                     {"dimension: 4\nsizes: 3 4 5 1\n", 3},
                                     {"dimension: 4\nsizes: 3 1 4 5\n", 1},
                                     {"dimension: 4\nsizes: 3 4 1 5\n", 2}}) {
    std::string spacings = "spacings:", mins = "axis mins:", units = "units:", labels = "labels:",
                kinds = "kinds:", centers = "centers:";
    int number = 0;
    for (int axis = 0; axis < 4; ++axis) {
      const bool is_left = axis == left;
      number += is_left ? 0 : 1;
      spacings += is_left ? " nan" : fmt::format(" {}.5", number);
      mins += is_left ? " 77" : fmt::format(" {}0", number);
      units += is_left ? " \"a \\\" b\"" : fmt::format(" \"u {}\"", number);
      labels += is_left ? " \"\"" : fmt::format(" \"l{}\"", number);
      kinds += is_left ? " vector" : " domain";
      centers += is_left ? " cell" : " node";
    }
    const NrrdHeader header = header_of(fmt::format("{}{}\n# a comment\n{}\n{}\n{}\n{}\n{}\nkey:=value\n",
                                                    fields, spacings, mins, units, labels, kinds, centers));
    EXPECT_EQ(header.info.dims, (Index3{3, 4, 5})) << fields;
    EXPECT_EQ(
        text_of(header.info.metadata),
        "spacings: 1.5 2.5 3.5\n# a comment\naxis mins: 10 20 30\nunits: \"u 1\" \"u 2\" \"u 3\"\n"
        "labels: \"l1\" \"l2\" \"l3\"\nkinds: domain domain domain\ncenters: node node node\nkey:=value\n");
    EXPECT_EQ(header.info.geometry().spacing, (std::array<double, 3>{1.5, 2.5, 3.5}));
    EXPECT_EQ(header.info.geometry().origin, (std::array<double, 3>{10, 20, 30}));
    EXPECT_EQ(header.info.geometry().units, (std::array<std::string, 3>{"u 1", "u 2", "u 3"}));
  }
}

TEST(NrrdHeader, OfSeveralAxesOfOneSampleTheOneThatIsNotInSpaceIsLeftOut) {
  const auto directions = [](const std::string& axes) { return header_of(axes).info.geometry().directions; };
  const std::array<std::array<double, 3>, 3> two_three_four = {{{2, 0, 0}, {0, 3, 0}, {0, 0, 4}}};
  EXPECT_EQ(directions("dimension: 4\nsizes: 1 3 4 1\nspace: LPS\n"
                       "space directions: (2,0,0) (0,3,0) (0,0,4) none\n"),
            two_three_four);
  EXPECT_EQ(header_of("dimension: 4\nsizes: 1 3 4 1\nspace: LPS\n"
                      "space directions: (2,0,0) (0,3,0) (0,0,4) none\n")
                .info.dims,
            (Index3{1, 3, 4}));
  EXPECT_EQ(header_of("dimension: 4\nsizes: 1 3 4 1\nkinds: space space space list\n").info.dims,
            (Index3{1, 3, 4}));
  EXPECT_EQ(header_of("dimension: 4\nsizes: 1 3 4 1\n").info.dims, (Index3{3, 4, 1}));
  EXPECT_EQ(header_of("dimension: 6\nsizes: 1 3 4 1 5 1\n").info.dims, (Index3{3, 4, 5}));
  EXPECT_EQ(header_of("dimension: 5\nsizes: 1 1 1 1 1\n").info.dims, (Index3{1, 1, 1}));
}

TEST(NrrdHeader, TwoAxesAreASlice) {
  const Geometry plain_slice =
      header_of("dimension: 2\nsizes: 3 4\nspacings: 0.5 2\nunits: \"mm\" \"mm\"\naxis mins: 1 nan\n")
          .info.geometry();
  EXPECT_EQ(plain_slice.spacing[1], 2);
  EXPECT_TRUE(std::isnan(plain_slice.spacing[2]));
  EXPECT_EQ(plain_slice.units[2], "");
  const NrrdHeader in_space = header_of(
      "dimension: 2\nsizes: 3 4\nspace: LPS\nspace directions: (0,2,0) (0,0,4)\nspace origin: (1,2,3)\n");
  EXPECT_EQ(in_space.info.dims, (Index3{3, 4, 1}));
  EXPECT_EQ(in_space.info.geometry().directions,
            (std::array<std::array<double, 3>, 3>{{{0, 2, 0}, {0, 0, 4}, {1, 0, 0}}}));
  EXPECT_EQ(in_space.info.geometry().origin, (std::array<double, 3>{1, 2, 3}));
  const Geometry in_plane = header_of(
                                "dimension: 2\nsizes: 3 4\nspace dimension: 2\nspace directions: (2,0) (0, "
                                "4)\nspace origin: (1,2)\n")
                                .info.geometry();
  EXPECT_EQ(in_plane.directions, (std::array<std::array<double, 3>, 3>{{{2, 0, 0}, {0, 4, 0}, {0, 0, 1}}}));
  EXPECT_EQ(in_plane.origin, (std::array<double, 3>{1, 2, 0}));
  for (const std::string directions :
       {"(2,0) none", "(2,0) (4,0)", "(2,0) (0,4,0)", "(2) (4)", "(2,x) (0,4)"})
    EXPECT_THROW(
        header_of("dimension: 2\nsizes: 3 4\nspace dimension: 2\nspace directions: " + directions + "\n"),
        BrokenInput)
        << directions;
}

TEST(NrrdHeader, FilesOfMoreAxesHoldWholeSlices) {
  const auto files = [](const std::string& axes, const std::string& numbers) {
    return header_of(axes + "data file: s%d " + numbers + "\n").data_files.size();
  };
  EXPECT_EQ(files("dimension: 4\nsizes: 1 3 4 5\n", "1 5 1"), 5U);
  EXPECT_EQ(files("dimension: 4\nsizes: 1 3 4 5\n", "1 5 1 4"), 5U);
  EXPECT_EQ(files("dimension: 4\nsizes: 3 4 5 1\n", "1 5 1 2"), 5U);
  EXPECT_EQ(files("dimension: 4\nsizes: 3 4 5 1\n", "1 1 1"), 1U);
  for (const std::string numbers : {"1 20 1 2", "1 5 1 5", "1 4 1", "1 5 1 1"})
    EXPECT_THROW(files("dimension: 4\nsizes: 1 3 4 5\n", numbers), BrokenInput) << numbers;
  EXPECT_THROW(files("dimension: 2\nsizes: 3 4\n", "1 4 1"), BrokenInput);
}

TEST(NrrdHeader, SampleBytesNeverOverflow) {
  EXPECT_EQ(sample_bytes({3, 4, 5}, SampleType::int16), 120u);
  EXPECT_EQ(sample_bytes({(std::int64_t{1} << 31) - 1, 1 << 20, 2048}, SampleType::uint8),
            ((std::uint64_t{1} << 31) - 1) << 31);
  EXPECT_FALSE(sample_bytes({std::int64_t{1} << 31, 1 << 20, 2048}, SampleType::uint8));
  EXPECT_FALSE(sample_bytes({INT64_MAX, INT64_MAX, INT64_MAX}, SampleType::float64));
  EXPECT_FALSE(sample_bytes({0, 1, 1}, SampleType::uint8));
}

RC_GTEST_PROP(NrrdHeader, AnyBytesAreReadOrRefused, ()) {
  const std::string all =
      "type: |short|uint8|dimension: 3|dimension: 4|dimension: 2|1 3 4 5|units: \"mm\" |sizes: |"
      "3 4 5|\n|\n|\n|:|:=|(1,0,0)|none|encoding: raw|encoding: gzip|endian: little|"
      "space directions: |space origin: |spacings: |nan|-|99999999999999999999|data file: |%d| |(|"
      ")|,|axis mins: 0 0 0|#|\r|byte skip: |\xff\xfe|centers: ";
  std::vector<std::string> pieces = {std::string(1, '\0')};
  std::istringstream in(all);
  for (std::string piece; std::getline(in, piece, '|');) pieces.push_back(piece);
  std::string text = *rc::gen::element<std::string>("", "NRRD0004\n", plain);
  const auto parts = *rc::gen::container<std::vector<std::string>>(rc::gen::elementOf(pieces));
  for (const auto& part : parts) text += part;
  text += *rc::gen::string<std::string>();
  try {
    const NrrdHeader header = parse_nrrd_header(text);
    const NrrdHeader again = parse_nrrd_header(nrrd_header_text(header.info, ""));
    RC_ASSERT(again.info.metadata == header.info.metadata);
  } catch (const BrokenInput&) {
  }
}

// NRRD: headers of others.

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
