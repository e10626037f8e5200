#include "tools/options/encoding_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>
#include <vector>

#include "io/files/errors.h"
#include "pipeline/encode/dims_order.h"
#include "pipeline/encode/likelier_reading.h"
#include "tools/options/command_line_error.h"
#include "tools/options/suggestion.h"
#include "tools/options/vdb_options.h"
#include "tools/report/report.h"

namespace tagrid {
namespace {

void add_bounds(CLI::App& command, EncodeOptions& o) {
  const char* group = "What is kept";
  add_number_option(command, "--max-error", o.max_error,
                    "Largest error of any voxel; 0, the default: lossless")
      ->option_text("E")
      ->group(group);
  add_number_option(command, "--surface-error", o.surface_error, "Tighter bound where the grid is refined")
      ->option_text("F")
      ->group(group);
  command.add_flag("--grid-only", o.grid_only, "Store the adaptive grid alone; voxels are interpolated")
      ->group(group);
  command
      .add_option_function<std::string>(
          "--effort",
          [&o](const std::string& word) {
            const auto found = std::find(effort_names.begin(), effort_names.end(), word);
            o.effort = static_cast<Effort>(found - effort_names.begin());
          },
          "fast, default or best: time for size, of voxels of 8 and 16 bits")
      ->check(one_of({"fast", "default", "best"}))
      ->option_text("fast|default|best")
      ->group(group);
  add_number_option(command, "--mesh-error", o.mesh_error,
                    "Refine until the mesh is within E of every sample; not below the bound of active voxels")
      ->option_text("E")
      ->group(group);
}

void add_grid_options(CLI::App& command, EncodingOptions& c) {
  const char* group = "The grid";
  EncodeOptions& o = c.options;
  add_number_option(command, "--accuracy", o.accuracy, "m: as good as a circle's m-gon (20)")
      ->option_text("m")
      ->group(group);
  add_number_option(command, "--cube", o.cube_size, "Edge of a root cube, a power of two, 4 .. 256 (32)")
      ->option_text("S")
      ->group(group);
  add_number_option(command, "--max-level", o.max_level, "Refine no further than this level")
      ->option_text("n")
      ->group(group);
  command
      .add_option("--range", c.range,
                  "Value range that counts as 8 voxels of height, or auto: that of the data")
      ->option_text("lo:hi|auto")
      ->group(group);
  add_number_option(command, "--field-scale", o.field_scale,
                    "Voxels of height per unit of value, instead of --range")
      ->option_text("lambda")
      ->group(group);
  add_number_option(command, "--brick", o.brick_edge, "Root cubes an edge of a brick; default max(2, 64/S)")
      ->option_text("N")
      ->group(group);
}

}  // namespace

Encoding EncodingOptions::checked() const {
  Encoding encoding{options, raw.description()};
  encoding.source.vdb_grid = vdb_grid;
  if (range == "auto") {
    encoding.options.range_from_data = true;
  } else if (!range.empty()) {
    encoding.options.range = value_range(range);
    if (!encoding.options.range) throw UsageError(fmt::format("--range {}: must be lo:hi or auto", range));
  }
  encoding.options.validate();
  return encoding;
}

void add_encoding_options(CLI::App& command, EncodingOptions& options) {
  add_bounds(command, options.options);
  add_grid_options(command, options);
  add_raw_options(command, options.raw);
  add_vdb_grid_option(command, options.vdb_grid);
}

OptionTexts encoding_options_given(const CLI::App& command) {
  CLI::App all;
  EncodingOptions unused;
  all.set_help_flag();
  add_encoding_options(all, unused);
  OptionTexts texts;
  for (const CLI::Option* option : all.get_options()) {
    const std::string& name = option->get_lnames().front();
    const CLI::Option* given = command.get_option_no_throw("--" + name);
    if (given != nullptr && given->count() > 0) texts[name] = given->results().back();
  }
  return texts;
}

namespace {

std::string unknown_name(const CLI::App& known, const std::string& name) {
  std::vector<std::string> names;
  for (const CLI::Option* option : known.get_options()) names.push_back(option->get_lnames().front());
  const auto meant = nearest(name, names);
  return meant
             ? fmt::format("unknown option --{}; did you mean --{}?", name, *meant)
             : fmt::format("unknown option --{}; those of a volume are --{}", name, fmt::join(names, ", --"));
}

}  // namespace

Encoding encoding_of(const OptionTexts& texts) {
  CLI::App app;
  EncodingOptions options;
  app.set_help_flag();
  add_encoding_options(app, options);
  std::vector<std::string> arguments;
  for (const auto& [name, value] : texts) {
    if (app.get_option_no_throw("--" + name) == nullptr) throw UsageError(unknown_name(app, name));
    arguments.push_back("--" + name + "=" + value);
  }
  try {
    app.parse(std::move(arguments));
  } catch (const CLI::ParseError& error) {
    throw UsageError(explain(app, error));
  }
  return options.checked();
}

bool is_same_encoding(const Encoding& a, const Encoding& b, const VolumeReader& volume) {
  const auto settings = [&](const EncodeOptions& options) {
    return std::pair(settings_json(parameters_but_scale(options, volume.info())),
                     std::tuple(options.range, options.range_from_data, options.field_scale));
  };
  const auto source = [](const SourceDescription& given) {
    const RawDescription raw = given.raw.value_or(RawDescription{});
    return std::tuple(given.raw.has_value(), raw.dims, raw.type, raw.big_endian.value_or(false), raw.spacing,
                      raw.offset, given.vdb_grid);
  };
  return source(a.source) == source(b.source) && settings(a.options) == settings(b.options);
}

std::string difference_of(const OptionTexts& was, const OptionTexts& now) {
  for (const auto& [name, value] : was)
    if (const auto found = now.find(name); found == now.end() || found->second != value)
      return fmt::format("{} was {}, now {}", name, value, found == now.end() ? "not given" : found->second);
  for (const auto& [name, value] : now)
    if (!was.contains(name)) return fmt::format("{} was not given, now {}", name, value);
  return "";
}

namespace {

std::string in_words(SampleType type, bool big_endian) {
  const char* order = size_of(type) == 1 ? "" : big_endian ? " --endian big" : " --endian little";
  return fmt::format("--type {}{}", name_of(type), order);
}

std::string doubt(const RawDescription& given, const LikelierReading& likelier) {
  const std::string as_given = in_words(given.type, given.big_endian.value_or(false));
  if (likelier.sample_bytes == size_of(given.type))
    return fmt::format("looks far more like a volume with {} than with {}; check the type and the byte order",
                       in_words(likelier.type, likelier.big_endian), as_given);
  return fmt::format(
      "looks far more like samples of {} byte{} than with {}; check the type, and dims that fit it",
      likelier.sample_bytes, likelier.sample_bytes == 1 ? "" : "s", as_given);
}

}  // namespace

void warn_of_description(const RunOptions& run, const std::string& input, const RawDescription& description) {
  if (run.quiet) return;
  // Of samples that are none no order of dims is better than another.
  if (const auto reading = likelier_reading(input, description))
    return warn(run, input + ": " + doubt(description, *reading));
  const auto likelier = likelier_dims(input, description);
  if (!likelier) return;
  const Index3 &given = description.dims, &other = *likelier;
  warn(run, fmt::format("{}: looks far smoother with --dims {},{},{} than with {},{},{}; check their order, "
                        "x is the fastest",
                        input, other.x, other.y, other.z, given.x, given.y, given.z));
}

void warn_of_range(const RunOptions& run, const std::string& input, const EncodeOptions& asked,
                   const EncodeResult& result) {
  constexpr double far_more = 4;
  const CodingParameters& p = result.header.parameters;
  // Ranges of wide types are those of the data.
  if (asked.range || asked.range_from_data || asked.field_scale || is_wide_type(p.type)) return;
  const auto& [low, high] = std::pair(result.index.total.low, result.index.total.high);
  if (!(high - low > far_more * (p.range_high - p.range_low))) return;
  warn(run,
       fmt::format("{}: its samples lie between {} and {}, and the grid was made for {} .. {}, the range by "
                   "default of {}: it is finer, and the file larger, than may be wanted; {}--range lo:hi "
                   "gives the span that matters",
                   input == "-" ? "standard input" : input, low, high, p.range_low, p.range_high,
                   name_of(p.type), input == "-" ? "" : "--range auto takes that of the samples, "));
}

}  // namespace tagrid
