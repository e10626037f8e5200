// Options as text: rows of encodings, and numbers.
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tools/options/encoding_options.h"
#include "tools/options/numbers.h"

namespace tagrid {
namespace {

// One table of options: a line of a manifest means the same as these options on the command line.

// A possible value of each option that is not its default.
std::string example_of(const OptionRow& row) {
  if (!row.words.empty()) return row.words.back();
  if (row.value.empty()) return "true";
  if (row.value == "X,Y,Z") return "4,5,6";
  if (row.name == "range") return "1:2";
  return row.name == "type" ? "int8" : "8";
}

std::string text_of_options(const EncodingOptions& all) {
  const EncodeOptions& o = all.options;
  const auto number = [](const auto& value) { return value ? fmt::format("{}", *value) : "none"; };
  std::string rules;
  for (const auto& [kind, value] : all.rules) rules += fmt::format("{}:{} ", static_cast<int>(kind), value);
  const SourceOptions& source = all.source;
  const std::string overviews = o.overviews ? text_of(*o.overviews) : "auto";
  return fmt::format("{} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {}",
                     rules, o.grid ? name_of(*o.grid) : "", o.grid_only, number(o.max_error),
                     number(o.surface_error), number(o.mesh_error), o.accuracy, o.cube_size,
                     number(o.max_level), number(o.brick_edge), name_of(o.effort), number(o.field_scale),
                     all.range, source.dims, source.type, source.endian,
                     source.spacing + source.override_spacing, source.offset, source.vdb_grid, source.from,
                     source.series, source.dataset, source.gaps_ok, source.data_outside, o.strip, o.lead,
                     number(o.parity), overviews, fmt::join(o.thresholds, ","));
}

TEST(EncodingRows, MeanTheSameOnTheCommandLineAndInAManifest) {
  for (const auto& row : encoding_rows()) {
    CLI::App command;
    EncodingOptions given, set;
    add_encoding_options(command, given);
    const std::string option = row.value.empty() ? "--" + row.name : "--" + row.name + "=" + example_of(row);
    command.parse(std::vector<std::string>{option});
    set_row(row, set, example_of(row));
    EXPECT_EQ(text_of_options(given), text_of_options(set)) << row.name;
    EXPECT_NE(text_of_options(given), text_of_options({})) << row.name;
    EXPECT_EQ(encoding_options_given(command), (OptionTexts{{row.name, example_of(row)}}));
  }
}

TEST(EncodingRows, AMultipleOfTheNoiseReplacesANumberAndTheOtherWayRound) {
  EXPECT_EQ(encoding_of({{"max-error", "noise:2.5"}}).options.error_rule,
            (ErrorRule{ErrorRule::Kind::noise, 2.5}));
  EXPECT_EQ(encoding_of({{"psnr", "50"}}).options.error_rule, (ErrorRule{ErrorRule::Kind::psnr, 50}));
  for (const char* ratio : {"40", "40:1"})
    EXPECT_EQ(encoding_of({{"ratio", ratio}}).options.error_rule, (ErrorRule{ErrorRule::Kind::ratio, 40}));
  EXPECT_THROW(encoding_of({{"ratio", "40:2"}}), UsageError);
  EXPECT_EQ(encoding_of({{"bits", "0.5"}}).options.error_rule, (ErrorRule{ErrorRule::Kind::bits, 0.5}));
  EXPECT_EQ(encoding_of({{"relative-error", "0.5"}}).options.error_rule,
            (ErrorRule{ErrorRule::Kind::relative, 0.5}));
  CLI::App command;
  EncodingOptions last;
  add_encoding_options(command, last);
  command.get_option("--max-error")->take_last();
  // It takes them from the last to the first.
  command.parse(std::vector<std::string>{"--max-error=noise:2", "--max-error=3"});
  EXPECT_EQ(last.checked().options.max_error, std::nullopt);
  for (const char* text : {"noise", "noise:", "noise:x", "noise:-1", "noise:0", "Noise:1", "noise:nan"})
    EXPECT_THROW(encoding_of({{"max-error", text}}), UsageError) << text;
  const EncodeOptions both = encoding_of({{"max-error", "1"}, {"psnr", "50"}}).options;
  EXPECT_EQ(both.error_rule, (ErrorRule{ErrorRule::Kind::psnr, 50}));
  EXPECT_EQ(both.max_error, 1);
  for (const OptionTexts& two : {OptionTexts{{"max-error", "noise:1"}, {"psnr", "50"}},
                                 {{"relative-error", "1"}, {"psnr", "50"}},
                                 {{"ratio", "10"}, {"psnr", "50"}},
                                 {{"ratio", "10"}, {"max-error", "5"}},
                                 {{"bits", "1"}, {"grid", "stored"}},
                                 {{"bits", "1"}, {"mesh-error", "5"}},
                                 {{"relative-error", "1"}, {"max-error", "0"}}})
    EXPECT_THROW(encoding_of(two), UsageError);
}

TEST(EncodingRows, RefuseWordsThatAreNone) {
  for (const char* name : {"effort", "endian", "grid", "grid-only"})
    EXPECT_THROW(encoding_of({{name, "maybe"}}), UsageError) << name;
}
TEST(Numbers, WholeNumbersAreDecimal) {
  EXPECT_EQ(whole_number<int>("020"), 20);
  EXPECT_EQ(whole_number<int>("+3"), 3);
  EXPECT_EQ(whole_number<int>("-3"), -3);
  EXPECT_EQ(whole_number<std::int64_t>("9223372036854775807"), std::numeric_limits<std::int64_t>::max());
  for (const char* text : {"", "+", "-", "+-3", "0x10", "1.0", "1e3", " 1", "1 ", "1,", "99999999999"})
    EXPECT_FALSE(whole_number<int>(text)) << text;
  EXPECT_FALSE(whole_number<std::uint64_t>("-1"));
}

TEST(Numbers, FiniteNumbersAreDecimalAndFinite) {
  EXPECT_EQ(finite_number("2"), 2.0);
  EXPECT_EQ(finite_number("-.5"), -0.5);
  EXPECT_EQ(finite_number("+1e3"), 1000.0);
  EXPECT_FALSE(std::signbit(*finite_number("-0")));
  for (const char* text : {"", "nan", "inf", "-inf", "1e999", "0x1p3", "1,5", "1 ", "+-1", "1e", "--1"})
    EXPECT_FALSE(finite_number(text)) << text;
}

TEST(Numbers, BytesAreCountedInPowersOf1024) {
  EXPECT_EQ(byte_count("12"), 12U);
  EXPECT_EQ(byte_count("3K"), 3072U);
  EXPECT_EQ(byte_count("2M"), 2097152U);
  EXPECT_EQ(byte_count("1G"), 1073741824U);
  EXPECT_EQ(byte_count("3T"), std::uint64_t{3} << 40);
  EXPECT_EQ(byte_count("2MiB"), 2097152U);
  EXPECT_EQ(byte_count("17179869183G"), std::uint64_t{17179869183} << 30);
  EXPECT_EQ(byte_count("+2MB"), 2097152U);
  EXPECT_EQ(byte_count("3k"), 3072U);
  EXPECT_EQ(byte_count("1.5G"), 1610612736U);
  EXPECT_EQ(byte_count("0.3KiB"), 307U);
  for (const char* text :
       {"", "K", "-1", "iB", "12iB", "12B", "MB", "1.5", "-1.5G", ".G", "1.5.5G", "1MiBB", "1GM", "1e3G",
        "1.5e3G", "nanG", "17179869184G", "17179869184.5G", "18446744073709551616"})
    EXPECT_FALSE(byte_count(text)) << text;
}

TEST(Numbers, SizesAreThree) {
  EXPECT_EQ(three_sizes("1,2147483648,3"), (Index3{1, std::int64_t{1} << 31, 3}));
  for (const char* text : {"", "1", "1,2", "1,2,", ",1,2", "1,,2,3", "1,2,3,", "1,2,3,4", "0,1,1", "1,1,-1",
                           "1,1,2147483649", "1, 2,3", "1;2;3"})
    EXPECT_FALSE(three_sizes(text)) << text;
}

TEST(Numbers, ASpacingIsOneDistanceOrThreePerhapsWithAUnit) {
  const auto is = [](const char* text, double x, double y, double z, const std::string& unit) {
    EXPECT_EQ(given_spacing(text), (GivenSpacing{{x, y, z}, unit, false})) << text;
  };
  is("0.5,1,1e3", 0.5, 1, 1000, "");
  is("10um", 10, 10, 10, "um");
  is("1,2,3 microns", 1, 2, 3, "um");
  is("1mm,2mm,3mm", 1, 2, 3, "mm");
  is("1e-3in", 1e-3, 1e-3, 1e-3, "inch");
  for (const char* text : {"", "1,1", "1,0,1", "1,-1,1", "1,nan,1", "1,1,1e301", "1,1,1,1", "inf", "um",
                           "1px", "1um,2,3", "1um,2um,3", "1um,2um,3mm", "1,2um,3um", "1um,2,3um", "1,,2"})
    EXPECT_FALSE(given_spacing(text)) << text;
}

TEST(Numbers, ARangeHasTwoEnds) {
  EXPECT_EQ(value_range("-1024:3072"), (std::pair{-1024.0, 3072.0}));
  for (const char* text : {"", ":", "1", "1:", ":1", "1:2:3", "a:1", "0:inf"})
    EXPECT_FALSE(value_range(text)) << text;
}

}  // namespace
}  // namespace tagrid
