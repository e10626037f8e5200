// tagrid encode: encodes a volume to a .tag file.

#include <algorithm>
#include <filesystem>
#include <functional>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/temporaries.h"
#include "io/formats/table/formats.h"
#include "io/formats/table/open_volume.h"
#include "io/parity/parity.h"
#include "io/parts/part_folder.h"
#include "io/system/files.h"
#include "io/text/paths.h"
#include "io/text/text.h"
#include "pipeline/job/resolved_options.h"
#include "pipeline/run/run.h"
#include "tools/archive/input_removal.h"
#include "tools/commands/commands.h"
#include "tools/options/encoding_options.h"
#include "tools/options/output_options.h"
#include "tools/report/failure.h"
#include "tools/report/process.h"
#include "tools/report/report.h"
#include "tools/report/run_report.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

struct EncodeCommand {
  std::string input;
  OutputOptions output;
  RunOptions run;
  EncodingOptions encoding;
  bool remove = false, trust_description = false, resume = false;

  void execute(Ranks& ranks) const {
    run.obey_memory_limit();
    require_volume_input(input, "encode - -o FILE.tag");
    if (output.path.empty() && input.ends_with(".tag"))
      throw UsageError(input +
                       ": has the name of an encoded volume; use tagrid decode to decode it, or give -o FILE "
                       "if it is a volume");
    const std::string path = output.path.empty() ? output_for(input) : output.path;
    refuse_terminal(ranks, path, "compressed bytes");
    Encoding asked = encoding.checked(run);
    asked.source.all_volumes = true;
    if (remove) refuse_without_bound(asked.options, "--rm");
    if (trust_description && !remove)
      throw UsageError(
          "--trust-description: has an effect only together with --rm; give --rm, or leave it out");
    if (resume) require_resumable(path);
    remove_abandoned(run, {input}, {path});
    // If the run continues an earlier one, its report may exist already.
    const bool goes_on = resume && (status_of(part_folder_of(path) + "/run") || status_of(path));
    RunReport report(run.json, run.thread_count(), output.overwrite || goes_on, "encode", input, path);
    std::vector<std::string> removed_after;
    if (remove) removed_after = files_to_remove(asked, path);
    if (!resume) warn_of_record(path);
    if (asked.source.raw) warn(run, doubt_of_description(input, *asked.source.raw));

    const bool has_parity_beside =
        output.overwrite && is_regular_output(path) && is_regular_input(parity_beside(path));
    const UnchangedFiles watched(removed_after);
    FinishedEncode encoded = encode(ranks, asked, path);
    const EncodeResult& result = encoded.result;
    if (remove) verify_encoding(input, asked.source, result.temporary, watched, run.resources(ranks));
    if (remove)
      if (const std::string lost = lost_structure(result.header, result.index.total); !lost.empty())
        throw UsageError("{}: {}; leave out --rm", input, lost);
    RunFigures figures = figures_of(result.header, result.index, result.bytes_in, result.file_bytes);
    figures.volumes = result.header.volumes;
    if (!result.reason_of_bound.empty()) figures.settings["reason_of_max_error"] = result.reason_of_bound;
    figures.more["lossy_source"] = json_text_or_null(result.lossy_source);
    const auto written = remove ? status_of(result.temporary) : std::nullopt;
    report.write(figures, encoded);
    const UnchangedFiles copy(remove ? std::vector{path} : std::vector<std::string>());
    for (const std::string& warning : warnings_of_encoding(input, asked.options, result)) warn(run, warning);
    if (format_with_extension(path) != nullptr)
      warn(run, "{}: is a .tag file in spite of its name; tagrid decode writes other formats", path);
    if (has_parity_beside)
      warn(run, "{}: may be of an earlier file; remove it, or protect {} again", parity_beside(path), path);
    if (result.was_complete && !run.quiet)
      say("tagrid: {}: already exists, and is what this run would write; it was compared with the input",
          path);
    if (!result.reason_of_bound.empty() && !run.quiet) say_line("tagrid: " + result.reason_of_bound);
    if (run.shows_times())
      for (const std::string& line : times_summary(result.header)) say_line(line);
    if (run.says_result()) say_line(summary(result));
    if (run.is_verbose()) {
      say_line(memory_summary(result.memory, result.times_read));
      if (!result.why_not_restorable.empty())
        say("{}: cannot be restored byte for byte: {}", shown_input(input), result.why_not_restorable);
    }
    watched.require();
    if (!remove) return;
    const auto named = status_of(path);
    if (!written || !named || !named->is_same_file(*written))
      throw BrokenInput(path + ": was replaced by another run after it was verified; the input was kept");
    remove_replaced({removed_after, watched, copy}, path);
  }

  // "scan.tag" for "scan.nrrd", and for the folders "scan" and "scan/".
  static std::string output_for(std::string input) {
    if (!is_folder(input)) return output_beside(input, ".tag");
    input = text_of(path_of(input));  // with / for the \\ of Windows
    while (input.size() > 1 && input.ends_with('/')) input.pop_back();
    if (const fs::path name = path_of(input).filename();
        name == "." || name == ".." || name == "/" || name.empty())
      throw UsageError(input + ": is a directory without a name of its own; give -o FILE");
    return input + ".tag";
  }

  std::vector<std::string> files_to_remove(const Encoding& asked, const std::string& path) const {
    const char* advice = "leave out --rm";
    OtherHeaders headers;
    auto files = removable_volume(input, asked.source, path, headers, advice);
    const auto volume = open_volume(input, asked.source);
    const double max_error = in_samples(asked.options, volume->facts()).parameters.max_error;
    require_replaceable(
        input,
        {max_error, volume->facts().headerless, trust_description, why_not_understood(volume->facts())},
        advice);
    require_files_come_back(input, asked.source, volume->facts(), !asked.options.strip, advice);
    return files;
  }

  FinishedEncode encode(Ranks& ranks, const Encoding& asked, const std::string& path) const {
    ProgressMeter meter(run.progress, run.quiet, "encoding", 1),
        search(run.progress, run.quiet, "searching for the largest error", 1);
    return encode_volume(ranks, {.input = input,
                                 .source = asked.source,
                                 .output = path,
                                 .overwrite = output.overwrite,
                                 .options = asked.options,
                                 .resources = run.resources_of_each_rank(),
                                 .progress = meter.progress(),
                                 .searching =
                                     [&](std::uint64_t done, std::uint64_t total) {
                                       search.update(done, total);
                                       meter.begin();
                                     },
                                 .keep_files = true,
                                 .resume = resume,
                                 .verified = remove,
                                 .program = "tagrid " TAGRID_VERSION,
                                 .goes_on = tell_of_parts(),
                                 .before_copy = tell_of_copy(run)});
  }

  std::function<void(std::int64_t, std::int64_t)> tell_of_parts() const {
    if (!run.is_watched()) return {};
    return [](std::int64_t there, std::int64_t parts) {
      say("tagrid: continuing: {} of {} parts are done", there, parts);
    };
  }

  void warn_of_record(const std::string& path) const {
    if (!is_regular_output(path) || path == "-" || !status_of(part_folder_of(path) + "/run")) return;
    warn(run, "{}: is the record of an unfinished run; give --resume to continue it", part_folder_of(path));
  }

  // The run makes, checks and removes the directory of its parts. A report in its place would stop the run.
  void keep_report_apart(const std::string& parts) const {
    if (run.json.empty() || run.json == "-") return;
    if (is_below(real_path(path_of(run.json)), real_path(path_of(parts))))
      throw UsageError("--json {}: {} is the directory for the parts of the run; choose a file outside it",
                       run.json, parts);
  }

  // Checks that the run can be continued. From now on, a signal leaves its parts.
  void require_resumable(const std::string& path) const {
    if (!is_regular_output(path)) throw UsageError("--resume: the output must be a file; give -o FILE");
    // If the input does not exist, opening it gives the message.
    if (input == "-" || (status_of(input) && !is_file_or_folder(input)))
      throw UsageError("--resume: the input must be a file or a directory, which can be read again");
    keep_report_apart(part_folder_of(path));
    end_signals_with(exit_resumable,
                     run.quiet ? "" : "tagrid: interrupted; the same command continues from here\n");
  }
};

}  // namespace

Action add_encode_command(CLI::App& app) {
  auto state = std::make_shared<EncodeCommand>();
  CLI::App* command = app.add_subcommand("encode", "Encode a volume into a .tag file");
  command->add_option("INPUT", state->input, volume_input_help)->required();
  add_output_options(*command, state->output);
  add_encoding_options(*command, state->encoding);
  add_job_options(*command, state->run, true);
  add_removal_options(*command, state->remove);
  add_trust_option(*command, state->trust_description);
  command->add_flag("--resume", state->resume,
                    "Keep finished parts in .NAME.parts, and continue after an interruption");
  return [state](Ranks& ranks) { state->execute(ranks); };
}

}  // namespace tagrid
