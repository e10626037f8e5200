// One table of options: a line of a manifest means the same as these options on the command line.
#include "tools/options/encoding_rows.h"

#include <gtest/gtest.h>

namespace tagrid {
namespace {

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
  return fmt::format("{} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {}", rules,
                     name_of(o.grid), o.grid_only, number(o.max_error), number(o.surface_error),
                     number(o.mesh_error), o.accuracy, o.cube_size, number(o.max_level), number(o.brick_edge),
                     name_of(o.effort), number(o.field_scale), all.range, source.dims, source.type,
                     source.endian, source.spacing, source.offset, source.vdb_grid, source.from,
                     source.series, source.dataset, source.gaps_ok, o.strip);
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
  for (const OptionTexts& two : {OptionTexts{{"max-error", "1"}, {"psnr", "50"}},
                                 {{"max-error", "noise:1"}, {"psnr", "50"}},
                                 {{"relative-error", "1"}, {"psnr", "50"}},
                                 {{"relative-error", "1"}, {"max-error", "0"}}})
    EXPECT_THROW(encoding_of(two), UsageError);
}

TEST(EncodingRows, RefuseWordsThatAreNone) {
  for (const char* name : {"effort", "endian", "grid", "grid-only"})
    EXPECT_THROW(encoding_of({{name, "maybe"}}), UsageError) << name;
}

}  // namespace
}  // namespace tagrid
