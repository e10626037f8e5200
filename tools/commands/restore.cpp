// tagrid restore: gives back the files that a .tag file was encoded from.

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <optional>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/temporaries.h"
#include "io/metadata/loss.h"
#include "io/text/paths.h"
#include "io/text/text.h"
#include "pipeline/restore/restore.h"
#include "tools/archive/removed_originals.h"
#include "tools/commands/commands.h"
#include "tools/options/output_options.h"
#include "tools/report/damage.h"
#include "tools/report/failure.h"
#include "tools/report/process.h"
#include "tools/report/report.h"
#include "tools/report/run_report.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

/// What a directory is called below `all`, which holds those of all originals. On Windows, nothing holds directories of
/// several drives and shares, and each has the name of its own: C/scans, server/share/scans.
fs::path place_below(const fs::path& all, const fs::path& folder) {
  if (fs::path place = relative_path(folder, all); !place.empty()) return place;
  std::string place = text_of(folder);
  std::erase(place, ':');
  return path_of(place.substr(std::min(place.find_first_not_of('/'), place.size())));
}

struct RestoreCommand {
  std::string input, records, keys;
  OutputOptions output;
  RunOptions run;

  void execute(Ranks& ranks) const {
    run.obey_memory_limit();
    if (!records.empty()) return restore_all(ranks);
    if (!keys.empty())
      throw UsageError("--keys: has the names in records; give --records DIR, or leave it out");
    if (input.empty()) throw UsageError("give a .tag file, or --records DIR");
    if (input == "-")
      throw UsageError("standard input: only a regular file can be restored; save it as one first");
    if (output.path.empty()) throw UsageError("give -o DIR, the directory for the files");
    if (output.path == "-") throw UsageError("-o -: files are restored into a directory; give -o DIR");
    remove_abandoned(run, {input}, {});
    if (remove_abandoned_folders({output.path + "/restored"}) > 0 && run.is_watched())
      say_line("tagrid: removed the hidden directory of a killed run");
    RunReport report(run.json, run.thread_count(), output.overwrite, "restore", input, output.path);
    Finished<RestoreResult> restored = restore(ranks);
    const RestoreResult& result = restored.result;
    RunFigures figures = figures_of(result.header, result.index, result.bytes_in, result.bytes_out);
    figures.volumes = result.header.volumes;
    figures.settings["exact"] = result.header.parameters.is_exact();
    figures.settings["files"] = result.kept.files.size();
    figures.settings["compression"] = json_text_or_null(result.kept.compression);
    figures.settings["lossy_source"] = json_text_or_null(result.header.metadata.text_of(lossy_source_key));
    report.write(figures, restored);
    tell(result);
  }

  // Restores every original that convert removed to its place. A failure does not stop the others.
  void restore_all(Ranks& ranks) const {
    if (!input.empty())
      throw UsageError("--records: restores all originals of a directory; leave out " + input);
    if (!run.json.empty()) throw UsageError("--records: has no statistics; leave out --json");
    std::optional<KeyFile> key_file;
    if (!keys.empty()) key_file.emplace(keys);
    const auto [originals, unknown] = removed_originals(records, key_file ? &*key_file : nullptr);
    const std::string all = folder_of_all(originals);
    std::size_t restored = 0, there = 0, failed = 0;
    for (const RemovedOriginal& original : originals) {
      // Not even with -f, which is for what is left of an original: others may have been changed since.
      if (original.is_back && output.path.empty()) {
        ++there;
        continue;
      }
      RestoreCommand one = *this;
      one.input = original.output;
      if (output.path.empty())
        one.output.path = original.folder;
      else
        one.output.path =
            text_of(normal_path(path_of(output.path) / place_below(path_of(all), path_of(original.folder))));
      one.records.clear();
      one.keys.clear();
      try {
        if (!original.error.empty()) throw BrokenInput(original.error);
        // Relative records name it relative to the outputs, which may have moved without the
        // originals.
        if (output.path.empty() && !is_folder(original.folder))
          warn(run, "{}: does not exist, and is created for {}; to restore to another directory, use -o DIR",
               original.folder, original.input);
        with_repair_advice(one.input, [&] { one.execute(ranks); });
        ++restored;
      } catch (const std::exception&) {
        ++failed;
        say("tagrid: {}: {}", original.input, current_failure().message);
      }
    }
    for (const std::string& sentence : unknown) say_line("tagrid: " + sentence);
    if (run.is_watched() || failed > 0 || !unknown.empty())
      say("originals: {}, {} restored, {} {} there, {} failed", originals.size(), restored, there,
          there == 1 ? "was" : "were", failed);
    if (failed > 0)
      throw BrokenInput("{} of {} could not be restored", failed, counted(originals.size(), "original"));
    if (!unknown.empty())
      throw BrokenInput(records +
                        ": some records cannot be read, so originals that they name were not restored");
  }

  Finished<RestoreResult> restore(const Ranks& ranks) const {
    ProgressMeter meter(run.progress, run.quiet, "restoring", 1);
    return restore_files({.input = input,
                          .folder = output.path,
                          .overwrite = output.overwrite,
                          .resources = run.resources(ranks),
                          .progress = meter.progress()});
  }

  /// "a.dcm and 3 other files" among those that `is_meant`.
  template <class Meant>
  static std::string named(const std::vector<EnvelopeFile>& files, Meant is_meant) {
    const auto first = std::ranges::find_if(files, is_meant);
    const auto others = std::ranges::count_if(first + 1, files.end(), is_meant);
    return printable(first->name) + (others == 0 ? "" : " and " + counted(others, "other file"));
  }

  void tell(const RestoreResult& result) const {
    const auto& [files, compression] = result.kept;
    const bool is_exact = result.header.parameters.is_exact();
    // Often only the compression showed the loss, and that is gone.
    const std::string loss = result.header.metadata.text_of(lossy_source_key);
    if (!compression.empty())
      warn(run, "{}: {} {} not restored byte for byte: samples were compressed ({}), and now are not{}",
           output.path, named(files, &EnvelopeFile::is_changed),
           std::ranges::count_if(files, &EnvelopeFile::is_changed) == 1 ? "is" : "are",
           printable(compression),
           loss.empty() ? ""
                        : fmt::format("; some were compressed with loss ({}), which the .tag file records, "
                                      "but the restored files may not",
                                      printable(loss)));
    if (!is_exact && result.index.total.max_error > 0)
      warn(run, "{}: the samples in {} were not kept exactly; they differ by up to {}", output.path,
           named(files, [](const EnvelopeFile& file) { return !file.slices.empty(); }),
           error_text(result.index.total.max_error, result.header));
    if (run.is_verbose())
      for (const EnvelopeFile& file : files) say("{}/{}: {} bytes", output.path, file.name, file.size);
    if (run.says_result() && is_exact && compression.empty())
      say("{} restored, byte for byte: all checksums agree", counted(files.size(), "file"));
  }
};

}  // namespace

void restore_files_of(const std::string& input, const std::string& folder, bool overwrite,
                      const RunOptions& run, Ranks& ranks) {
  RestoreCommand one;
  one.input = input;
  one.output = {.path = folder, .overwrite = overwrite};
  one.run = run;
  with_repair_advice(input, [&] { one.execute(ranks); });
}

Action add_restore_command(CLI::App& app) {
  auto state = std::make_shared<RestoreCommand>();
  CLI::App* command = app.add_subcommand("restore", "Restore the source files of a .tag file, byte for byte");
  add_tag_input(*command, state->input, ".tag file or its address");
  add_text_option(*command, "--records", state->records, "DIR",
                  "Restore all originals that convert --remove-verified removed; DIR is its --output-dir");
  add_text_option(*command, "--keys", state->keys, "FILE", "Key file of an archive without names");
  add_text_option(*command, "-o,--output", state->output.path, "DIR",
                  "Directory for the files; it is created if needed");
  command->add_flag("-f,--force", state->output.overwrite, "Overwrite files that exist");
  add_job_options(*command, state->run, false);
  return [state](Ranks& ranks) { with_repair_advice(state->input, [&] { state->execute(ranks); }); };
}

}  // namespace tagrid
