#include "tools/archive/settings_used.h"

#include <fmt/format.h>

#include <tuple>

#include "pipeline/job/resolved_options.h"
#include "tools/report/info.h"

namespace tagrid {
namespace {

using nlohmann::ordered_json;

auto members_of(const SourceDescription& given) {
  const RawDescription raw = given.raw.value_or(RawDescription{});
  return std::tuple(given.raw.has_value(), raw.dims, raw.type, raw.big_endian.value_or(false), raw.offset,
                    given.spacing, given.vdb_grid, given.from, given.series, given.dataset, given.gaps_ok,
                    given.data_outside);
}

/// The settings as the file will have them; a text in place of a number that follows from the samples.
ordered_json settings_of(const EncodeOptions& given, const VolumeSource& volume) {
  const ResolvedOptions options = in_samples(given, volume.facts());
  ordered_json settings = settings_json(options.parameters);
  if (options.range_from_data) settings["range"] = settings["field_scale"] = "that of the data";
  if (!options.options.error_rule) return settings;
  const std::string rule = text_of_rule(options.options);
  settings["max_error"] = rule;
  // Whether samples are transformed, and the size of bricks then, follows from a PSNR, too.
  if (options.parameters.transform_step == 0) return settings;
  settings["transform_step"] = rule;
  if (!given.brick_edge) settings["brick"] = rule;
  return settings;
}

std::string difference_of_texts(const OptionTexts& was, const OptionTexts& now) {
  for (const auto& [name, value] : was)
    if (const auto found = now.find(name); found == now.end() || found->second != value)
      return fmt::format("{} was {}, now {}", name, value, found == now.end() ? "not given" : found->second);
  for (const auto& [name, value] : now)
    if (!was.contains(name)) return fmt::format("{} was not given, now {}", name, value);
  return "";
}

/// The first setting of `now` that `was` lacks; "" if there is none. `was` has the results of rules.
std::string difference_of_settings(const ordered_json& was, const ordered_json& now, bool with_rules) {
  for (const auto& [name, value] : now.items()) {
    const bool is_rule =
        value.is_string() && (name == "max_error" || name == "range" || name == "field_scale" ||
                              name == "transform_step" || name == "brick");
    const auto found = was.is_object() ? was.find(name) : was.end();
    // A program that did not know the setting wrote a file without it.
    if (found == was.end() && value.is_null()) continue;
    if (found == was.end()) return fmt::format("{} is not recorded, now {}", name, value.dump());
    if (*found != value && (with_rules || !is_rule))
      return fmt::format("{} was {}, now {}", name, found->dump(), value.dump());
  }
  return "";
}

}  // namespace

std::string difference_of(const KnownOutput& known, const OptionTexts& asked, const RunOptions& run,
                          const VolumeSource& volume) {
  const Encoding was = encoding_of(known.options, run), now = encoding_of(asked, run);
  const ordered_json settings = settings_of(now.options, volume);
  std::string difference = difference_of_settings(settings_of(was.options, volume), settings, true);
  if (difference.empty() &&
      (members_of(was.source) != members_of(now.source) || was.options.strip != now.options.strip ||
       was.options.parity != now.options.parity || was.options.overviews != now.options.overviews))
    difference = "other options of the input";
  // Users recognize the texts that they gave, not what these became.
  if (!difference.empty())
    if (const std::string in_texts = difference_of_texts(known.options, asked); !in_texts.empty())
      return in_texts;
  if (!difference.empty()) return difference;
  // The program that wrote the output may have had other defaults, which also depend on the type.
  const ordered_json record = ordered_json::parse(known.record);
  return record.value("type", ordered_json()) == name_of(volume.info().type)
             ? difference_of_settings(record.value("settings", ordered_json()), settings, false)
             : "";
}

}  // namespace tagrid
