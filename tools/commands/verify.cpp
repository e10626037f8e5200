// tagrid verify: checks that a .tag file is intact, and that it matches the original.

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/open_source.h"
#include "io/formats/table/open_volume.h"
#include "io/parity/parity.h"
#include "io/tag/whole_bricks.h"
#include "io/text/text.h"
#include "pipeline/memory/parity.h"
#include "pipeline/restore/restore.h"
#include "pipeline/run/run.h"
#include "tools/commands/commands.h"
#include "tools/options/encoding_options.h"
#include "tools/repair/survey.h"
#include "tools/report/damage.h"
#include "tools/report/info.h"
#include "tools/report/report.h"
#include "tools/report/run_report.h"

namespace tagrid {
namespace {

struct VerifyCommand {
  std::string input, original;
  RunOptions run;
  bool overwrite = false;
  EncodingOptions encoding;  ///< only those of a source can be given

  void execute(Ranks& ranks) const {
    run.obey_memory_limit();
    const SourceDescription description = run.limited(encoding.source.description());
    if (original.empty() && encoding.source != SourceOptions{})
      throw UsageError(
          "--dims, --from and the other options of an input are for the original; give it with --against");
    if (input == "-" && original == "-")
      throw UsageError("--against -: standard input is already the .tag file; give a file");
    require_tag_input(input);
    require_volume_input(original, "verify FILE.tag --against -");
    refuse_tag_original();
    RunReport report(run.json, run.thread_count(), overwrite, "verify", input, "", original);
    const VerifyResult result = verified(ranks, description, report);
    RunFigures figures = figures_of(result.header, result.index, result.bytes_in, 0);
    figures.volumes = result.header.volumes;
    figures.settings["against"] = json_text_or_null(original);
    const std::vector<std::string>& differences = result.geometry.differences;
    // Where the geometry differs, the files do, too; but that says less.
    const std::string files = differences.empty() ? compare_files(description) : "not compared";
    if (!original.empty()) {
      figures.settings["source_files"] = files;
      figures.more["geometry"] = {{"compared", result.geometry.compared}, {"differences", differences}};
    }
    const auto parity = is_regular_input(input) ? parity_of_intact() : std::nullopt;
    if (parity) figures.more["parity"] = json_of(parity->condition);
    report.write(figures);
    report.keep();
    if (!run.quiet && run.json != "-") tell(result, files);
    if (parity && parity->file.is_beside() && !parity->condition.is_file_intact())
      throw BrokenInput(
          "{}: the volume is intact, but {} is of an earlier or another file; remove it, and protect the "
          "file again",
          shown_input(input), parity_beside(input));
    if (parity && !parity->condition.is_intact())
      throw BrokenInput("{}: the volume is intact, but its parity is damaged; {}", shown_input(input),
                        parity->file.is_beside()
                            ? fmt::format("remove {}, and protect the file again", parity_beside(input))
                            : parity_words(*parity));
    if (parity && !run.quiet && run.json != "-") {
      fmt::print("parity: {}; any {}, or any burst of {} bytes, can be repaired\n", parity_words(*parity),
                 counted(parity->file.layout().parity, "damaged block"), parity->file.layout().burst());
      std::fflush(stdout);
    }
    if (!differences.empty()) throw BrokenInput("{}: {}", shown_input(input), fmt::join(differences, "; "));
  }

  void refuse_tag_original() const {
    if (original.empty() || !is_regular_input(original)) return;
    if (file_begins_as_tag(*open_source(original)))
      throw BrokenInput(
          "{}: is a .tag file, which cannot be the original; decode it first: tagrid decode {} --samples -o "
          "original.nrrd",
          printable(original), word_of_command(original));
  }

  /// Only where parity is seen without a search.
  std::optional<SurveyedParity> parity_of_intact() const {
    const bool is_in_file = parity_at_end(*open_source(input)).has_value();
    if (!is_in_file && !is_regular_input(parity_beside(input))) return std::nullopt;
    auto parity = survey_parity(input, run, "checking parity");
    if (!parity)
      throw BrokenInput(
          "{}: the volume is intact, but nothing of {} can be read; remove it, and protect the file again",
          shown_input(input), parity_beside(input));
    return parity;
  }

  std::string parity_words(const SurveyedParity& parity) const {
    const ParityCondition& condition = parity.condition;
    if (condition.is_intact()) return "intact";
    if (!condition.is_repairable()) return why_not_repairable(parity, input);
    return fmt::format("repairable ({}): {}", damage_text(condition), repair_command(input));
  }

  static nlohmann::ordered_json json_of(const ParityCondition& condition) {
    return {{"intact", condition.is_intact()},
            {"repairable", condition.is_repairable()},
            {"damaged_blocks", condition.damaged_blocks},
            {"damaged_parity", condition.damaged_parity}};
  }

  /// Whether parity brings a damaged file back; nothing for a file without parity, or if a limit on memory
  /// leaves too little to say so.
  std::optional<SurveyedParity> parity_of_damaged() const {
    try {
      return survey_parity(input, run, "checking parity");
    } catch (const MemoryLimit&) {
      return std::nullopt;
    }
  }

  void tell_of_parity(const SurveyedParity& parity, bool is_newer) const {
    // What was protected may have been damaged, or may differ from the original.
    const std::string words =
        !parity.condition.is_intact() ? parity_words(parity)
        : is_newer ? "the file is as it was protected; nothing else of it can be checked by this version"
                   : "intact, and no help: the file is as it was protected";
    fmt::print("{}: {}\n", printable(shown_input(input)), words);
    std::fflush(stdout);  // the error follows on another stream
  }

  void tell(const VerifyResult& result, const std::string& files) const {
    fmt::print("{}: {} {} intact; {}\n", printable(shown_input(input)), result.bricks,
               result.bricks == 1 ? "brick is" : "bricks are",
               result.active_points
                   ? fmt::format("the grid of {} active points is conforming", *result.active_points)
                   : "the grid was not computed, as this needs more memory");
    if (result.max_error)
      fmt::print("largest error against {}: {}\n", printable(original),
                 error_text(*result.max_error, result.header));
    if (result.mesh_error)
      fmt::print("largest error of the mesh: {}\n", error_text(*result.mesh_error, result.header));
    const char* members =
        result.header.volumes > 1 ? "volumes after the first one, and overviews" : "overviews";
    if (!result.are_members_decoded)
      fmt::print("{}: only their checksums were checked, as a pipe is read once\n", members);
    if (!result.are_members_compared)
      fmt::print("{}: not compared with {}, which can be read only once\n", members, printable(original));
    if (original.empty()) return;
    if (result.geometry.differences.empty()) fmt::print("geometry: {}\n", words_of(result.geometry));
    fmt::print("source files: {}\n", files);
    std::fflush(stdout);  // an error may follow on another stream
  }

  /// REQUIRES: no differences.
  static std::string words_of(const GeometryComparison& found) {
    if (!found.compared.empty()) return fmt::format("the same ({})", fmt::join(found.compared, ", "));
    const std::string_view why = found.file_places_samples && found.original_places_samples
                                     ? "they define other parts of it, or in ways that cannot be compared"
                                 : found.file_places_samples     ? "the original does not define it"
                                 : found.original_places_samples ? "the file does not define it"
                                                                 : "neither file defines it";
    return fmt::format("not compared: {}", why);
  }

  /// Compares the files of the original. Throws BrokenInput if files of the same names differ.
  std::string compare_files(const SourceDescription& description) const {
    if (original.empty() || original == "-" || !is_regular_input(input) || !is_file_or_folder(original))
      return "not compared";
    const TagBricks file(open_source(input));
    if (file.sizes().envelope == 0) return "not kept";
    const auto volume = open_volume(original, source_of_as_many(description, file.header()));
    const SourceComparison found = compare_source_files(file, *volume, run.thread_count());
    if (found.is_same) {
      const std::string same = file.parameters().is_exact() ? "the same" : "identical except for samples";
      if (!found.compression.empty())
        return fmt::format("{}, uncompressed (the samples of the original are compressed: {})", same,
                           printable(found.compression));
      return file.parameters().is_exact() ? same + ", byte for byte" : same;
    }
    if (found.has_same_names) require_same(found, volume->name());
    return "not those that were encoded: " + found.difference;
  }

  /// A damaged file is looked at once more: the first error does not say how much is lost.
  VerifyResult verified(Ranks& ranks, const SourceDescription& description, RunReport& report) const {
    try {
      return verify(ranks, description);
    } catch (const BrokenInput& broken) {
      if (!is_regular_input(input)) throw;
      const auto parity = parity_of_damaged();
      const bool is_newer = is_newer_format(broken);
      if (!is_newer) tell_of_damage(report, parity);
      if (parity && !run.quiet && run.json != "-") tell_of_parity(*parity, is_newer);
      if (is_newer) throw;
      const std::string words = words_of_damage(input, broken);
      if (parity && !parity->condition.is_file_intact() && parity->condition.is_repairable())
        throw BrokenInput("{}; {} rebuilds what is damaged", words, repair_command(input));
      throw BrokenInput(words);
    }
  }

  /// A volume with its lost bricks.
  struct DamagedVolume {
    std::uint32_t number = 0;
    std::vector<BrickRun> lost;
    bool has_others = false;  ///< not all are lost
  };

  static DamagedVolume damage_of(std::uint32_t number, const WholeBricks& volume) {
    return {number, volume.lost(), volume.whole_count() > 0};
  }

  /// The volumes of a file that lost bricks. Those after the first one are found by the directory of the index.
  static std::vector<DamagedVolume> damaged_volumes(const WholeBricks& file) {
    std::vector<DamagedVolume> damaged = {damage_of(0, file)};
    for (const Member& member : file.damaged_members()) {
      if (!member.is_volume()) continue;
      try {
        damaged.push_back(damage_of(member.factor, WholeBricks(file.bytes_of(member))));
      } catch (const BrokenInput&) {
        // Its header is damaged, without which no brick can be decoded.
        damaged.push_back({member.factor, {{0, file.parameters().bricks().count() - 1}}});
      }
    }
    std::erase_if(damaged, [](const DamagedVolume& volume) { return volume.lost.empty(); });
    return damaged;
  }

  void tell_of_damage(RunReport& report, const std::optional<SurveyedParity>& parity) const {
    std::optional<WholeBricks> file;
    try {
      file.emplace(open_source(input));
    } catch (const BrokenInput&) {
      return;  // not even the header is intact
    }
    const CodingParameters& parameters = file->header().parameters;
    const BrickGrid bricks = parameters.bricks();
    const std::vector<DamagedVolume> damaged = damaged_volumes(*file);
    if (damaged.empty() && !file->is_damaged_elsewhere()) return;  // it differs from the original
    const bool has_several = file->header().volumes > 1;
    RunFigures figures = {parameters.dims, parameters.type, settings_json(parameters), file->file_bytes(), 0,
                          nullptr};
    figures.volumes = file->header().volumes;
    figures.settings["against"] = json_text_or_null(original);
    nlohmann::ordered_json& boxes = figures.more["damaged"] = nlohmann::ordered_json::array();
    for (const DamagedVolume& volume : damaged)
      for (nlohmann::ordered_json& box : json_of_lost(volume.lost, bricks)) {
        if (has_several) box["volume"] = volume.number;
        boxes.push_back(std::move(box));
      }
    const bool has_directory = file->index().has_value();
    if (has_several) figures.more["volumes_found"] = has_directory ? file->header().volumes : 1;
    if (parity) figures.more["parity"] = json_of(parity->condition);
    report.write(figures);
    report.keep();
    if (run.quiet || run.json == "-") return;
    if (has_several && !has_directory)
      fmt::print("{}: only volume 0 of {} can be found, as the directory is damaged\n",
                 printable(shown_input(input)), file->header().volumes);
    if (damaged.empty() && !has_several)
      fmt::print("{}: all bricks are intact; decode --salvage decodes them\n", printable(shown_input(input)));
    for (const DamagedVolume& volume : damaged) {
      const std::string name =
          printable(shown_input(input)) + (has_several ? fmt::format(": volume {}", volume.number) : "");
      for (const std::string& line : lines_of_lost(volume.lost, bricks)) fmt::print("{}: {}\n", name, line);
      const std::string option = has_several ? fmt::format(" --volume {}", volume.number) : "";
      fmt::print("{}: {}{}\n", name, count_of_lost(volume.lost, bricks),
                 volume.has_others ? fmt::format("; decode --salvage{} decodes all others", option) : "");
    }
    std::fflush(stdout);  // the error follows on another stream
  }

  VerifyResult verify(Ranks& ranks, const SourceDescription& description) const {
    ProgressMeter meter(run.progress, run.quiet, "verifying", 1);
    return verify_file(ranks, {.input = input,
                               .original = original.empty() ? std::nullopt : std::optional(original),
                               .source = description,
                               .resources = run.resources_of_each_rank(),
                               .progress = meter.progress()});
  }
};

}  // namespace

Action add_verify_command(CLI::App& app) {
  auto state = std::make_shared<VerifyCommand>();
  CLI::App* command =
      app.add_subcommand("verify", "Check that a .tag file is intact, or compare it with the original");
  add_tag_input(*command, state->input);
  add_text_option(*command, "--against", state->original, "ORIGINAL", "Compare every voxel with this volume");
  add_source_options(*command, state->encoding);
  add_report_options(*command, state->run, state->overwrite);
  return [state](Ranks& ranks) { state->execute(ranks); };
}

}  // namespace tagrid
