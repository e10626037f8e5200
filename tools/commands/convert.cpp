// tagrid convert: encodes many volumes, each to its own .tag file.

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <optional>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/system/files.h"
#include "io/system/this_process.h"
#include "io/text/paths.h"
#include "io/text/text.h"
#include "tools/archive/conversion.h"
#include "tools/archive/find_volumes.h"
#include "tools/archive/input_removal.h"
#include "tools/archive/key_file.h"
#include "tools/archive/manifest.h"
#include "tools/archive/name_template.h"
#include "tools/archive/records.h"
#include "tools/commands/commands.h"
#include "tools/report/damage.h"
#include "tools/report/human_bytes.h"
#include "tools/report/process.h"
#include "tools/report/progress.h"
#include "tools/report/report.h"
#include "tools/report/run_report.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

/// "i/n"; i counts from 0.
Shard shard_option(const std::string& text) {
  const std::size_t slash = text.find('/');
  const auto index = whole_number<std::size_t>(std::string_view(text).substr(0, slash));
  const auto count =
      slash == text.npos ? std::nullopt : whole_number<std::size_t>(std::string_view(text).substr(slash + 1));
  if (!index || !count || *index >= *count)
    throw UsageError("--shard {}: must be i/n: part i of n parts, with i from 0 to n - 1", text);
  return {*index, *count};
}

struct ConvertCommand {
  std::string manifest, shard;
  EncodingOptions encoding;
  ConversionOptions options;
  bool remove_verified = false, keep_folders = false;
  std::string find, naming;

  void execute(Ranks& ranks, const OptionTexts& given) const {
    refuse_address(find);
    refuse_address(manifest);
    if (!find.empty()) {
      refuse_beside_find(given);
      return list_volumes();
    }
    if (!naming.empty())
      throw UsageError("--name: names the outputs of a list that --find makes; give it with --find");
    if (manifest.empty() || options.output_dir.empty())
      throw UsageError("convert: give --manifest FILE and --output-dir DIR, or --find ROOT to make a list");
    options.run.obey_memory_limit();
    if (options.trust_description && !remove_verified)
      throw UsageError(
          "--trust-description: has an effect only together with --remove-verified; give --remove-verified, "
          "or leave it out");
    const Shard part = shard.empty() ? Shard{} : shard_option(shard);
    // Checks the options even if no volume remains to be encoded.
    const Encoding asked = encoding_of(given, options.run);
    std::vector<ManifestLine> lines = read_manifest(manifest, given, keep_folders);
    if (!options.keys.empty()) keep_names_out(lines);
    if (lines.empty()) require_records();
    if (remove_verified) refuse_lines_without_bound(asked, lines);
    keep_report_apart(lines);
    // The report may be the first file in the directory of the outputs.
    if (!remove_verified && path_of(options.run.json).parent_path() == path_of(options.output_dir))
      make_output_dir();
    RunReport report(options.run.json, options.run.thread_count(), options.overwrite, "convert", manifest,
                     options.output_dir);
    if (!remove_verified)
      make_output_dir();
    else if (!status_of(options.output_dir))
      throw WorldError(options.output_dir + ": does not exist; nothing has been converted to it yet");
    if (!is_folder(options.output_dir))
      throw UsageError(options.output_dir + ": is not a directory; give the directory for the outputs");
    LineFile results(options.output_dir + "/" + results_name(part));
    const std::vector<ManifestLine> own = lines_of(part, lines);
    if (!remove_verified) remove_abandoned_of(own);
    const ConversionSums sums = remove_verified ? remove_originals(ranks, own, lines, options, results)
                                                : encode_lines(ranks, own, options, results);
    report.write_json({{"shard", json_text_or_null(shard)},
                       {"results", results.name()},
                       {"files", sums.files},
                       {"ok", sums.ok},
                       {"compared", sums.compared},
                       {"skipped", sums.skipped},
                       {"removed", sums.removed},
                       {"failed", sums.failed},
                       {"not_restorable", sums.not_restorable},
                       {"bytes_in", sums.bytes_in},
                       {"bytes_out", sums.bytes_out}});
    report.keep();
    const char* wrong = remove_verified ? "not removed" : "failed";
    if (options.run.is_watched()) {
      say_line(summary(sums, wrong));
      if (sums.not_restorable > 0)
        say("{} of them cannot be restored byte for byte{}", sums.not_restorable,
            options.run.verbosity > 0 ? "" : "; -v lists them, and why");
    }
    if (sums.failed > 0)
      throw BrokenInput("{} of {} {}; see {}", sums.failed, counted(sums.files, "volume"), wrong,
                        results.name());
  }

  // Nothing in the directory of the outputs may name an input.
  void keep_names_out(std::vector<ManifestLine>& lines) const {
    require_outside("--keys", options.keys, options.output_dir);
    if (is_regular_output(manifest)) require_outside("--manifest", manifest, options.output_dir);
    if (is_regular_output(options.run.json) && !options.run.json.empty())
      require_outside("--json", options.run.json, options.output_dir);
    const KeyFile keys(options.keys);
    keys.require_writable();
    warn_of_others(keys);
    bool has_headers = false;
    for (ManifestLine& line : lines) {
      try {
        require_keyed_output(line, keys);
      } catch (const UsageError& error) {
        throw UsageError("{}: {}", shown_input(manifest), error.what());
      }
      line.is_relative = false;  // paths in the key file do not depend on the archive
      has_headers = has_headers || !encoding_of(line.options, options.run).options.strip;
    }
    if (has_headers && !remove_verified)
      warn(options.run,
           "--keys: outputs keep the headers of their volumes, with the names in them; --strip omits these");
  }

  void warn_of_others(const KeyFile& keys) const {
    if (keys.is_open_to_others())
      warn(options.run, "{}: others can read it; chmod 600 {}", keys.path(), word_of_command(keys.path()));
  }

  // Once all originals are removed, the list that --find makes of their directory is empty.
  void require_records() const {
    const std::string what = shown_input(manifest) + ": contains no volumes";
    if (!status_of(options.output_dir) || KnownOutputs(options.output_dir).files() == 0)
      throw UsageError(
          what +
          "; every line of a list begins with the path of a volume, and lines that begin with # are "
          "ignored");
    warn(options.run, "{}; nothing is left to do", what);
  }

  // A list has the options of each volume; those for all volumes are given when it is converted.
  void refuse_beside_find(const OptionTexts& given) const {
    const auto refuse = [](const std::string& name) {
      throw UsageError("{}: has no effect with --find, which encodes nothing; give it with --manifest", name);
    };
    for (const auto& [name, is_given] : {std::pair("--manifest", !manifest.empty()),
                                         {"--output-dir", !options.output_dir.empty()},
                                         {"--shard", !shard.empty()},
                                         {"--keep-folders", keep_folders},
                                         {"--skip-done", options.skip_done},
                                         {"--remove-verified", remove_verified},
                                         {"--trust-description", options.trust_description},
                                         {"--force", options.overwrite},
                                         {"--json", !options.run.json.empty()}})
      if (is_given) refuse(name);
    for (const auto& [name, value] : given)
      if (name != "gaps-ok" && name != "data-outside") refuse("--" + name);
  }

  // Writes a list for --manifest to the standard output.
  void list_volumes() const {
    std::optional<KeyFile> keys;
    if (!options.keys.empty()) warn_of_others(keys.emplace(options.keys, true));
    std::optional<NameTemplate> names;
    if (keys || !naming.empty()) names.emplace(naming.empty() ? "{hash}" : naming, keys ? &*keys : nullptr);
    std::size_t count = 0, broken = 0, nameless = 0, passed_over = 0;
    // A list in a file has names as they are; a terminal must not act on them.
    const bool is_shown = is_terminal(standard_output);
    const auto print = [&](const std::string& name) { fmt::print("{}", is_shown ? printable(name) : name); };
    // A list on a terminal is its own progress.
    ListMeter meter(is_shown ? ProgressStyle::none : options.run.progress, options.run.quiet, std::nullopt);
    std::string directory;
    const auto enter = [&](const std::string& path) { meter.begin_volume(directory = path); };
    const auto found = [&](const FoundVolume& volume) {
      std::string text = volume.text;
      switch (volume.kind) {
        case FoundVolume::Kind::broken:
        case FoundVolume::Kind::nameless:
          ++(volume.kind == FoundVolume::Kind::broken ? broken : nameless);
          fmt::print("# not listed: {}\n", printable(text));
          return warn(options.run, text);
        case FoundVolume::Kind::passed_over:
          passed_over += volume.files;
          return fmt::print("# passed over: {}\n", printable(text));
        case FoundVolume::Kind::volume:
          break;
      }
      ++count;
      meter.end_volume(0);
      meter.begin_volume(directory);
      // Descriptions of series may have several lines.
      std::ranges::replace_if(
          text, [](char c) { return c == '\n' || c == '\r' || c == '\0'; }, ' ');
      fmt::print("# {}\n", printable(text));
      print(volume.path);
      for (const auto& [name, value] : volume.options) {
        fmt::print("\t{}=", name);
        print(value);
      }
      fmt::print("\toutput=");
      print(volume.output);
      if (keys) fmt::print("\tmark={}", mark_of_output(output_called(volume.output), *keys));
      fmt::print("\n");
      std::fflush(stdout);
    };
    find_volumes(find, encoding.source, options.run, names ? &*names : nullptr, {enter, found});
    if (!options.run.quiet) {
      std::string sums = fmt::format("volumes: {}", count);
      if (broken > 0) sums += fmt::format(", {} cannot be read", broken);
      if (passed_over > 0)
        sums += fmt::format(", {} passed over, as comments of the list say", counted(passed_over, "file"));
      say_line(sums);
    }
    if (nameless > 0)
      throw BrokenInput("{} not listed, because --name gives no name or that of another one",
                        counted(nameless, "volume"));
    if (broken > 0)
      throw BrokenInput("{} of {} cannot be read; see the comments of the list", broken,
                        counted(count + broken, "volume"));
  }

  // A line may have the bound that the command lacks. Without any, only the original of that line is kept.
  void refuse_lines_without_bound(const Encoding& asked, const std::vector<ManifestLine>& lines) const {
    if (has_bound(asked.options)) return;
    for (const ManifestLine& line : lines) {
      try {
        refuse_without_bound(encoding_of(line.options, options.run).options, "--remove-verified");
      } catch (const UsageError& error) {
        throw UsageError("{}: line {}: {}", shown_input(manifest), line.number, error.what());
      }
    }
  }

  static std::string summary(const ConversionSums& sums, const char* wrong) {
    std::string text = fmt::format("volumes: {}", sums.files);
    const auto add = [&](std::size_t count, const char* what) {
      if (count > 0) text += fmt::format(", {} {}", count, what);
    };
    add(sums.ok - sums.compared, "encoded");
    add(sums.compared, "already there and compared");
    add(sums.removed, "removed");
    add(sums.skipped, "skipped");
    add(sums.failed, wrong);
    if (sums.bytes_out > 0)
      text += fmt::format("; {} -> {}", human_bytes(sums.bytes_in), human_bytes(sums.bytes_out));
    return text;
  }

  std::string results_name(const Shard& part) const {
    return shard.empty() ? "results.jsonl" : fmt::format("results-{}-of-{}.jsonl", part.index, part.count);
  }

  void remove_abandoned_of(const std::vector<ManifestLine>& lines) const {
    std::vector<std::string> inputs, outputs;
    for (const ManifestLine& line : lines) {
      inputs.push_back(line.input);
      if (is_below_output_dir(line)) outputs.push_back(options.output_dir + "/" + line.output);
    }
    remove_abandoned(options.run, inputs, outputs);
  }

  /// If this is false, the line fails later. Nothing outside the directory is removed before that.
  bool is_below_output_dir(const ManifestLine& line) const {
    try {
      require_own_folders(options.output_dir, line.output);
      return true;
    } catch (const std::exception&) {
      return false;
    }
  }

  // The report of the run must not replace records or outputs, even with -f.
  void keep_report_apart(const std::vector<ManifestLine>& lines) const {
    if (options.run.json.empty()) return;
    const fs::path report = real_path(path_of(options.run.json)), folder = path_of(options.output_dir);
    const std::string name = name_of_path(options.run.json);
    if (name.starts_with("results") && name.ends_with(".jsonl") &&
        real_path(folder / path_of(name)) == report)
      throw UsageError("--json " + options.run.json +
                       ": is the name of a file of records; choose another name");
    for (const ManifestLine& line : lines)
      if (real_path(folder / path_of(line.output)) == report)
        throw UsageError("--json " + options.run.json + ": is an output of the list; choose another name");
  }

  void make_output_dir() const {
    if (!files().make_folder(options.output_dir) && errno != EEXIST)
      throw world_error("cannot create the directory", options.output_dir, errno);
    // Also if another run has just made it: originals may go because of what is in it.
    if (const int error = sync_folder(folder_of(options.output_dir)); error != 0)
      throw world_error("cannot sync its parent directory", options.output_dir, error);
  }
};

}  // namespace

Action add_convert_command(CLI::App& app) {
  auto state = std::make_shared<ConvertCommand>();
  CLI::App* command = app.add_subcommand("convert", "Encode the volumes of a list, and verify each output");
  const std::string usual_group = command->option_defaults()->get_group();
  command->option_defaults()->group("The list");
  add_text_option(*command, "--manifest", state->manifest, "FILE",
                  "List of volumes, one per line, or - for standard input");
  add_text_option(*command, "--output-dir", state->options.output_dir, "DIR",
                  "Directory for the outputs and their records");
  add_text_option(*command, "--find", state->find, "ROOT",
                  "Encode nothing; print a list of all volumes below ROOT, for --manifest");
  command->add_flag("--keep-folders", state->keep_folders,
                    "Keep the directories of the list: 2019/knee.nhdr becomes DIR/2019/knee.tag");
  add_text_option(*command, "--shard", state->shard, "i/n",
                  "Process only part i of n equal parts of the list; i counts from 0");
  add_text_option(*command, "--name", state->naming, "TEMPLATE",
                  "With --find: name outputs after fields of their volumes: {study_date}/{hash}");
  add_text_option(*command, "--keys", state->options.keys, "FILE",
                  "Keep names and paths of inputs in FILE, which is created, and out of the archive");
  CLI::Option* skip = command->add_flag("--skip-done", state->options.skip_done,
                                        "Skip volumes that are done according to the records");
  command
      ->add_flag("--remove-verified", state->remove_verified,
                 "Encode nothing; verify the outputs again, and remove their originals")
      ->excludes(skip);
  command->option_defaults()->group(usual_group);
  add_trust_option(*command, state->options.trust_description);
  command->add_flag("-f,--force", state->options.overwrite, "Overwrite files that exist");
  add_encoding_options(*command, state->encoding);
  add_job_options(*command, state->options.run, true);
  return [state, command](Ranks& ranks) { state->execute(ranks, encoding_options_given(*command)); };
}

}  // namespace tagrid
