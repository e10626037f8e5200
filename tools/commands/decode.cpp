// tagrid decode: writes the volume of a .tag file.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "io/files/file_attributes.h"
#include "io/files/temporaries.h"
#include "io/metadata/rescale.h"
#include "io/system/files.h"
#include "io/text/text.h"
#include "pipeline/run/run.h"
#include "tools/archive/input_removal.h"
#include "tools/commands/commands.h"
#include "tools/options/output_options.h"
#include "tools/report/damage.h"
#include "tools/report/process.h"
#include "tools/report/report.h"
#include "tools/report/run_report.h"

namespace tagrid {
namespace {

/// True for what can be read only from front to back.
bool is_pipe_input(const std::string& input) {
  return !is_regular_input(input) && (input == "-" || (status_of(input) && !is_folder(input)));
}

struct DecodeCommand {
  std::string input;
  OutputOptions output;
  RunOptions run;
  std::string format;
  VdbOptions vdb;
  std::string region;
  std::int64_t step = 1, overview = 0;
  bool remove = false, salvage = false, samples = false, values = false;
  std::optional<double> fill;
  std::optional<std::int64_t> volume;

  void execute(Ranks& ranks) const {
    run.obey_memory_limit();
    WantedRegion wanted = wanted_region(region);
    wanted.step = step;
    const std::string path = output.path.empty() ? default_output() : output.path;
    // A part with the name of the whole volume would be taken for it, or replace it.
    if (output.path.empty() && path != "-" && (!wanted.is_all() || overview != 0 || volume))
      throw UsageError(
          "a region, a step, an overview or a volume needs -o FILE: without it, the output would have the "
          "name of the entire volume");
    // For an NRRD file, "is not a .tag file" is the better message than "is its own output".
    if (output.path.empty() && path == input && path != "-") TagReader{input};
    require_tag_input(input);
    refuse_terminal(ranks, path, "samples");
    const Format& chosen = volume_format_option(format, path);
    check_vdb_options(vdb, chosen);
    refuse_contradictions();
    remove_abandoned(run, {input}, {path, samples_path(path, chosen)});
    if (chosen.writes.create != nullptr && path != "-") remove_abandoned_folders({path});
    RunReport report(run.json, run.thread_count(), output.overwrite, "decode", input, path,
                     samples_path(path, chosen));
    const UnchangedFiles watched(remove ? std::vector{input} : std::vector<std::string>());
    if (remove) require_replaceable_tag(input, path, {chosen, wanted, vdb, numbers()});

    FinishedDecode decoded = decode(ranks, path, chosen, wanted);
    const DecodeResult& result = decoded.result;
    const nlohmann::ordered_json facts =
        result.facts.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json::parse(result.facts);
    RunFigures figures = figures_with(facts, result, chosen);
    figures.volumes = volume ? 1 : result.header.volumes;
    report.write(figures, decoded);
    const UnchangedFiles written(remove ? std::vector{path, samples_path(path, chosen)}
                                        : std::vector<std::string>());
    if (chosen.has_grids) tell_of_tolerance(run, path, facts);
    if (chosen.writes.has_levels && !run.quiet && facts.at("levels").size() == 1)
      say("tagrid: {}: has the finest level alone; --overviews of encode makes others", path);
    for (const std::string& warning : result.warnings) warn(run, warning);
    tell_of_result(path, chosen, result);
    watched.require();
    if (remove) remove_replaced({{input}, watched, written}, input);
    if (result.salvage && result.salvage->is_damaged()) tell_of_damage(result);
  }

  void refuse_contradictions() const {
    if (samples && values) throw UsageError("--samples, --values: only one of them can be written");
    if (overview < 0) throw UsageError("--overview {}: must be the factor of an overview", overview);
    if (overview != 0 && (step != 1 || salvage || remove))
      throw UsageError("--overview: cannot be combined with --step, --salvage or --rm");
    if (overview != 0 && is_pipe_input(input))
      throw UsageError("{}: --overview needs a file, not a pipe; save it to one first", shown_input(input));
    if (volume && *volume < 0) throw UsageError("--volume {}: must be 0 or more", *volume);
    if (volume && remove) throw UsageError("--volume: the file may have others; leave out --rm");
    if (volume && is_pipe_input(input))
      throw UsageError("{}: --volume needs a file, not a pipe; save it to one first", shown_input(input));
    if (fill && !salvage) throw UsageError("--fill: applies only with --salvage; give --salvage as well");
    if (salvage && remove) throw UsageError("--salvage: a damaged file is not removed; leave out --rm");
    if (salvage && is_pipe_input(input))
      throw UsageError("{}: --salvage needs a file, not a pipe; save it to one first", shown_input(input));
  }

  /// `facts`: what the writer of the format says; null if nothing.
  static RunFigures figures_with(const nlohmann::ordered_json& facts, const DecodeResult& result,
                                 const Format& chosen) {
    const CodingParameters& parameters = result.header.parameters;
    RunFigures figures = figures_of(result.header, result.index, result.bytes_in, result.bytes_out);
    figures.dims = result.dims;
    if (!facts.is_null())
      figures.settings[figures.settings.contains(chosen.name) ? "written" : chosen.name] = facts;
    figures.more["written_type"] = name_of(result.numbers.type(parameters.type));
    figures.more["written_values"] = result.numbers.are_values();
    if (result.salvage) {
      // Errors against the original are known of whole volumes only.
      if (!result.salvage->has_index || !result.salvage->lost.empty()) figures.achieved = nullptr;
      figures.more["lost"] = json_of_lost(result.salvage->lost, parameters.bricks());
    }
    return figures;
  }

  /// Says what users should know of the output, and with -v what was done.
  void tell_of_result(const std::string& path, const Format& chosen, const DecodeResult& result) const {
    const std::string name = shown_output(path);
    const VolumeInfo written = {result.dims, result.numbers.type(result.header.parameters.type),
                                result.metadata};
    tell_of_numbers(name, chosen, result, chosen.keeps.lost_rescale(written));
    const std::vector<std::string> doubts = doubts_in(result.header.metadata);
    if (!doubts.empty())
      warn(run, "{}: was encoded in doubt: {}", shown_input(input),
           printable(fmt::format("{}", fmt::join(doubts, "; "))));
    if (const auto unknown = std::ranges::count_if(result.index.members, &Member::is_unknown); unknown > 0)
      warn(run, "{}: has {} of a newer version of tagrid, which the output lacks", shown_input(input),
           counted(static_cast<std::uint64_t>(unknown), "member"));
    for (const std::string& lost : losses(chosen, written)) warn(run, "{}: {}", name, lost);
    if (run.shows_times())
      for (const std::string& line : times_summary(result.header)) say_line(line);
    if (run.says_result()) say_line(summary(result));
    if (run.is_verbose()) {
      say_line(memory_summary(result.memory));
      if (const std::string lost = usual_losses(chosen, written); !lost.empty()) say("{}: {}", name, lost);
    }
  }

  Numbers numbers() const {
    return samples ? Numbers::samples : values ? Numbers::values : Numbers::automatic;
  }

  /// Says whether the output holds samples or values, if users could confuse them, and that its format has no
  /// place for slope and intercept, if `lost` says so.
  void tell_of_numbers(const std::string& name, const Format& chosen, const DecodeResult& result,
                       const std::string& lost) const {
    const auto tell_of_loss = [&] {
      if (!lost.empty()) warn(run, "{}: {}", name, lost);
    };
    if (run.quiet || numbers() != Numbers::automatic) return tell_of_loss();
    const Metadata& metadata = result.header.metadata;
    const Rescale& rescale = metadata.rescale();
    const auto added = [&] {
      return fmt::format("{} {}", rescale.intercept < 0 ? '-' : '+', std::abs(rescale.intercept));
    };
    if (result.numbers.are_values())
      return say("tagrid: {}: has values, sample {}, as {}; --samples writes the stored samples", name,
                 added(), name_of(result.numbers.rule.to));
    if (metadata.has_slopes_of_slices())
      return warn(run,
                  "{}: has stored samples, because each slice has its own slope and intercept; --values "
                  "writes values",
                  name);
    if (chosen.keeps.applies_rescale || (rescale.slope == 1 && rescale.intercept == 0)) return tell_of_loss();
    const std::string units = rescale.units.empty() ? "" : " " + printable(rescale.units);
    warn(run, "{}: has stored samples; values are {} * sample {}{}, but {}; --values writes values", name,
         rescale.slope, added(), units, lost.empty() ? "few programs apply this to such a file" : lost);
  }

  /// Lists what is lost. Throws BrokenInput: the volume is written, but it is not all that was encoded.
  void tell_of_damage(const DecodeResult& result) const {
    const BrickGrid bricks = result.header.parameters.bricks();
    const std::vector<BrickRun>& lost = result.salvage->lost;
    for (const std::string& line : lines_of_lost(lost, bricks)) say_line(input + ": " + line);
    throw BrokenInput(lost.empty()
                          ? input + ": is damaged, but all bricks are intact; every voxel was decoded"
                          : fmt::format("{}: {}; lost samples became {}, all others were decoded", input,
                                        count_of_lost(lost, bricks), fill.value_or(0)));
  }

  std::string default_output() const {
    const Format& asked = format_named(format.empty() ? "nrrd" : format);
    return output_beside(input, std::string(asked.extensions.front()));
  }

  FinishedDecode decode(Ranks& ranks, const std::string& path, const Format& chosen,
                        const WantedRegion& wanted) const {
    try {
      return decode_all(ranks, path, chosen, wanted);
    } catch (const BrokenInput& broken) {
      throw BrokenInput(salvage || overview ? words_with_repair(input, broken)
                                            : words_with_salvage(input, broken, volume));
    }
  }

  FinishedDecode decode_all(Ranks& ranks, const std::string& path, const Format& chosen,
                            const WantedRegion& wanted) const {
    ProgressMeter meter(run.progress, run.quiet, "decoding", 1);
    return decode_volume(ranks, {.input = input,
                                 .output = path,
                                 .format = chosen,
                                 .overwrite = output.overwrite,
                                 .region = wanted,
                                 .volume = volume,
                                 .overview = overview,
                                 .numbers = numbers(),
                                 .fill = salvage ? std::optional(fill.value_or(0)) : std::nullopt,
                                 .wishes = wishes_of(vdb),
                                 .resources = run.resources_of_each_rank(),
                                 .progress = meter.progress()});
  }
};

}  // namespace

void decode_as(const ExportedVolume& volume, const RunOptions& run, Ranks& ranks) {
  DecodeCommand one;
  one.input = volume.input;
  one.output = {.path = volume.output, .overwrite = volume.overwrite};
  one.format = volume.format;
  one.region = volume.region;
  one.step = volume.step;
  one.overview = volume.overview;
  one.values = volume.values;
  one.run = run;
  one.execute(ranks);
}

Action add_decode_command(CLI::App& app) {
  auto state = std::make_shared<DecodeCommand>();
  CLI::App* command = app.add_subcommand("decode", "Decode a .tag file into a volume");
  add_tag_input(*command, state->input);
  add_output_options(*command, state->output);
  add_format_option(*command, state->format);
  add_vdb_output_options(*command, state->vdb);
  add_region_option(*command, state->region);
  add_number_option(
      *command, "--step", state->step, "N",
      "Only every Nth sample along each axis, counted from 0 in the entire volume: 1, 2, 4, ...");
  add_volume_option(*command, state->volume);
  add_number_option(
      *command, "--overview", state->overview, "F",
      "The means of blocks of F samples along each axis, if the file has them (see tagrid info)");
  command->add_flag("--samples", state->samples, "Write stored samples instead of values");
  command->add_flag("--values", state->values,
                    "Write values in every format; integers if slope and intercept are, otherwise floats");
  command->add_flag("--salvage", state->salvage,
                    "Decode intact bricks of a damaged file and list the others; exits with 65");
  add_number_option(*command, "--fill", state->fill, "V",
                    "With --salvage: value of lost samples (default: 0)");
  add_job_options(*command, state->run, true);
  add_removal_options(*command, state->remove);
  return [state](Ranks& ranks) { state->execute(ranks); };
}

}  // namespace tagrid
