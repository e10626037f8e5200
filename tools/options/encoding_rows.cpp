#include "tools/options/encoding_rows.h"

#include <algorithm>

namespace tagrid {
namespace {

using Row = OptionRow<EncodingOptions>;

constexpr const char* kept = "Bounds and content";
constexpr const char* grid = "The grid";

template <class Value>
Row number_row(const Setting& setting, const char* group, const char* value, const char* help,
               Value EncodeOptions::*member) {
  const std::string name(setting.name);
  return {name, group, value, help, [name, member](EncodingOptions& o, const std::string& text) {
            read_number("--" + name, text, o.options.*member);
          }};
}

Row text_row(std::string_view name, const char* group, const char* value, const char* help,
             std::string EncodingOptions::*member) {
  return {std::string(name), group, value, help,
          [member](EncodingOptions& o, const std::string& text) { o.*member = text; }};
}

Row flag_row(std::string_view name, const char* group, const char* help, bool EncodeOptions::*member) {
  return {std::string(name), group, "", help,
          [name = std::string(name), member](EncodingOptions& o, const std::string& text) {
            o.options.*member = flag_value(name, text);
          }};
}

// The value whose name is `word`. REQUIRES: there is one.
template <class Value, std::size_t count>
void set_by_name(Value& value, const std::array<std::string_view, count>& names, const std::string& word) {
  value = static_cast<Value>(std::ranges::find(names, word) - names.begin());
}

void set_effort(EncodingOptions& o, const std::string& word) {
  set_by_name(o.options.effort, effort_names, word);
}

void set_grid(EncodingOptions& o, const std::string& word) {
  set_by_name(o.options.grid, grid_origin_names, word);
}

// A number, or noise:K. Of several the last counts.
void set_max_error(EncodingOptions& o, const std::string& text) {
  constexpr std::string_view noise = "noise:";
  o.options.max_error.reset();
  o.rules.erase(ErrorRule::Kind::noise);
  if (text.starts_with(noise))
    read_number("--max-error noise", text.substr(noise.size()), o.rules[ErrorRule::Kind::noise]);
  else
    read_number("--max-error", text, o.options.max_error);
}

Row rule_row(const Setting& setting, const char* value, const char* help, ErrorRule::Kind kind) {
  const std::string name(setting.name);
  return {name, kept, value, help, [name, kind](EncodingOptions& o, const std::string& text) {
            read_number("--" + name, text, o.rules[kind]);
          }};
}

std::vector<Row> all_rows() {
  using E = EncodeOptions;
  std::vector<Row> rows = {
      {"max-error", kept, "E|noise:K",
       "Maximum error of any voxel; 0, the default, is lossless; noise:K is K times the noise",
       set_max_error},
      rule_row(setting::relative_error, "R", "Maximum error as a fraction of the range of the samples",
               ErrorRule::Kind::relative),
      rule_row(setting::psnr, "D", "Loosest bound that reaches D dB", ErrorRule::Kind::psnr),
      number_row(setting::surface_error, kept, "F", "Tighter bound at the active points of the grid",
                 &E::surface_error),
      flag_row("strip", kept, "Drop metadata except geometry: names, dates, ...", &E::strip),
      flag_row("grid-only", kept, "Store only the adaptive grid; voxels between its points are interpolated",
               &E::grid_only),
      {"grid",
       kept,
       "stored|derived",
       "stored, the default: keep the grid of the original; derived: recompute it from decoded voxels on "
       "demand",
       set_grid,
       {"stored", "derived"}},
      {"effort",
       kept,
       "fast|default|best",
       "Trade time for size; no effect on bricks whose values span more than 65536 units",
       set_effort,
       {"fast", "default", "best"}},
      number_row(setting::mesh_error, kept, "E",
                 "Refine until the mesh is within E of every sample; at least the bound on active voxels",
                 &E::mesh_error),
      number_row(setting::accuracy, grid, "m",
                 "Follow the volume as closely as a regular m-gon follows its circle (default: 20)",
                 &E::accuracy),
      number_row(setting::cube, grid, "S", "Edge of a root cube: a power of two from 4 to 256 (default: 32)",
                 &E::cube_size),
      number_row(setting::max_level, grid, "n", "Refine no further than level n", &E::max_level),
      text_row(setting::range.name, grid, "lo:hi|auto",
               "Span of values that counts as 8 voxels of height; auto: the span of the data",
               &EncodingOptions::range),
      number_row(setting::field_scale, grid, "lambda",
                 "Voxels of height per unit of value, instead of --range", &E::field_scale),
      number_row(setting::brick, grid, "N", "Edge of a brick in root cubes (default: 64/S, but at least 2)",
                 &E::brick_edge),
  };
  for (const auto& row : source_rows()) {
    const auto set = [set = row.set](EncodingOptions& o, const std::string& text) { set(o.source, text); };
    rows.push_back({row.name, row.group, row.value, row.help, set, row.words});
  }
  return rows;
}

}  // namespace

const std::vector<Row>& encoding_rows() {
  static const std::vector<Row> rows = all_rows();
  return rows;
}

}  // namespace tagrid
