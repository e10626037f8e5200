#include "tools/archive/removal_pass.h"

#include <cerrno>
#include <ctime>
#include <filesystem>
#include <set>
#include <utility>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/file_bytes.h"
#include "io/formats/table/open_volume.h"
#include "io/system/files.h"
#include "io/tag/bricks.h"
#include "io/tag/file.h"
#include "io/text/paths.h"
#include "io/volume/one_of_volumes.h"
#include "pipeline/restore/restore.h"
#include "pipeline/run/run.h"
#include "tools/archive/input_removal.h"
#include "tools/archive/manifest.h"
#include "tools/archive/removal_table.h"
#include "tools/archive/settings_used.h"
#include "tools/options/encoding_options.h"
#include "tools/report/report.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;
using archive::Action;
using nlohmann::ordered_json;

std::string canonical_name(const std::string& path) { return text_of(real_path_if_known(path_of(path))); }

/// Adds all files below a directory that can be seen.
void add_files_below(const std::string& folder, std::vector<std::string>& all) {
  std::vector<FolderEntry> entries;
  files().list(folder, entries);
  for (const FolderEntry& entry : entries) {
    const std::string path = path_in(folder, entry.name);
    if (entry.type == FileType::folder)
      add_files_below(path, all);
    else if (!is_folder(folder, entry))
      all.push_back(path);
  }
}

std::string beginning_of_file(const std::string& path) {
  constexpr std::size_t most = 1 << 14;
  try {
    FileBytes file(path);
    return std::string(file.peek(most));
  } catch (const std::exception&) {
    return "";
  }
}

}  // namespace

RemovalPass::RemovalPass(const std::vector<ManifestLine>& lines, const ConversionOptions& options,
                         Resources resources, KnownOutputs& known, ListMeter& meter)
    : options_(options), resources_(std::move(resources)), known_(known), meter_(meter) {
  for (const ManifestLine& line : lines) count_files(line);
}

void RemovalPass::count_files(const ManifestLine& line) {
  const KnownOutput* known = known_.find(line.output);
  std::vector<std::string> files;
  try {
    require_file_or_folder(line.input);
    files = open_volume(line.input, encoding_of(known ? known->options : line.options, options_.run).source)
                ->files();
  } catch (const std::exception& error) {
    files = {line.input};
    const auto status = status_of(line.input);
    if (known && known->input == line.input)
      for (const InputFile& file : known->input_files) files.push_back(file.path);
    else if (status && status->is_folder()) {
      files.clear();
      add_files_below(line.input, files);
    } else if (status && status->is_file())
      unknown_.push_back({line.input, text_of(path_of(canonical_name(line.input)).parent_path()),
                          beginning_of_file(line.input), error.what()});
  }
  std::set<std::string> names;
  for (const std::string& file : files) names.insert(canonical_name(file));
  for (const std::string& name : names) ++lines_with_[name];
}

/// Throws UsageError if a file may belong to another volume, too.
void RemovalPass::require_not_needed(const ManifestLine& line, const std::string& file) const {
  const std::string name = canonical_name(file);
  if (const auto found = lines_with_.find(name); found == lines_with_.end() || found->second != 1)
    throw UsageError(file + ": also holds other volumes of the list; it is kept");
  // Beside a header, samples may lie that another header names, too.
  const bool is_data_file = name != canonical_name(line.input) && !is_folder(line.input);
  for (const UnknownFiles& other : unknown_)
    if ((is_data_file && path_of(name).parent_path() == path_of(other.folder)) ||
        other.beginning.find(name_of_path(name)) != std::string::npos)
      throw UsageError(
          "{}: may also belong to {}, which cannot be opened ({}); it is kept; repair that volume or, if "
          "nobody needs it, remove its header and its line in the list",
          file, other.input, other.why);
}

void RemovalPass::remove_original(const ManifestLine& line, ordered_json& record,
                                  const std::function<void()>& append) {
  const KnownOutput* known = known_.find(line.output);
  Volume volume{.line = line,
                .output = path_in(options_.output_dir, line.output),
                .known = known != nullptr ? std::optional(*known) : std::nullopt};
  archive::Facts facts;
  record["status"] = "kept";  // also if facts cannot be gathered: that is no failed encoding
  note_records(known_, line, volume.output, facts);
  facts.input = input_of(known_, line, options_.run);
  for (;;) switch (const Action action = decide(archive::removal_table(), facts)) {
      case Action::look:
        facts.input = look(volume, record);
        break;
      case Action::compare_options:
        compare_options(volume, facts);
        break;
      case Action::verify:
        verify(volume, facts);
        break;
      case Action::skip:
        skip(*volume.known, record);
        return append();
      case Action::remove:
        make_durable(line.output);
        // The record comes first: if the run is killed in between, the next one verifies the original again.
        return remove_replaced(*volume.removal, volume.output, [&] {
          require_removable_still(volume, facts, record);
          record["sequence"] = known_.next_sequence(line.output);
          record["status"] = "removed";
          append();
        });
      default:
        keep(action, volume, record);
    }
}

/// Reads what other runs wrote since: no record may be newer than that of the removal, which says that the
/// output is the only copy. Throws if one of them keeps the original.
void RemovalPass::require_removable_still(const Volume& volume, archive::Facts facts, ordered_json& record) {
  note_newer_records(known_, volume.line, volume.output, volume.known->record, facts);
  if (const Action action = decide(archive::removal_table(), facts); action != Action::remove)
    keep(action, volume, record);
}

void RemovalPass::keep(Action reason, const Volume& volume, ordered_json& record) const {
  const ManifestLine& line = volume.line;
  // What is not there is not kept.
  if (reason == Action::missing_copy || reason == Action::missing) record["status"] = "failed";
  if (reason == Action::missing_copy) throw missing_copy(volume.output);
  if (reason == Action::missing) throw world_error("cannot open", line.input, ENOENT);
  if (reason == Action::damaged) record["status"] = "damaged";
  if (volume.known && reason != Action::other_input) add_output(*volume.known, record);
  switch (reason) {
    case Action::never_encoded:
      throw UsageError("{}: its last encoding failed: {}; it is kept", line.input,
                       known_.last_failure(line.output));
    case Action::no_record:
      throw UsageError(
          "{}: no record says that it was encoded to {}; it is kept; give the list and the options of its "
          "encoding",
          line.input, volume.output);
    case Action::other_input:
      throw UsageError(
          "{}: {} is recorded as made from {}; if this is the same volume, --skip-done records it; otherwise "
          "choose another name (output=NAME)",
          line.input, line.output, volume.known->input);
    case Action::failed_since:
      throw UsageError(
          "{}: its last encoding failed: {}; it is kept until a run with --skip-done and the options of its "
          "encoding succeeds",
          line.input, known_.last_failure(line.output));
    case Action::unreadable:
      throw UsageError(
          "{}: {}, and may say that its encoding failed; it is kept until a run with --skip-done succeeds",
          line.input, known_.possibly_newer(line.output));
    case Action::other_volume:
      throw BrokenInput(
          "{}: is another volume than the one that was encoded ({}); it is kept; to encode it, choose "
          "another name (output=NAME)",
          line.input, other_volume(*volume.known, look_at(volume.removal->files)));
    case Action::other_options:
      throw UsageError(
          "{}: was encoded with other options: {}; the original is kept; give the options of its encoding, "
          "or encode it again",
          line.input, volume.difference);
    case Action::damaged:
      throw BrokenInput(volume.output + ": has changed since it was written; the original is kept");
    case Action::encoded_again:
      throw BrokenInput(volume.output +
                        ": was encoded again by another run in the meantime; the original is kept");
    case Action::changed:
      throw BrokenInput(line.input +
                        ": has changed since it was encoded; it is kept; --skip-done -f encodes it again");
    default:
      throw BrokenInput(line.output + ": another run recorded it in the meantime; the original is kept");
  }
}

/// Whoever made the directories of an output may have ended before they were durable.
void RemovalPass::make_durable(const std::string& output) {
  if (durable_folders_.insert(text_of(path_of(output).parent_path())).second)
    make_own_folders(options_.output_dir, output);
}

/// Finds the files of the volume, and compares them with the record. Throws if they cannot be removed.
archive::Input RemovalPass::look(Volume& volume, ordered_json& record) {
  const ManifestLine& line = volume.line;
  add_output(*volume.known, record);
  record["options"] = json_of(volume.known->options);
  require_own_folders(options_.output_dir, line.output);
  require_file_or_folder(line.input);
  const Encoding was = encoding_of(volume.known->options, options_.run);
  const auto files = removable_volume(line.input, was.source, volume.output, headers_, "it is kept");
  for (const std::string& file : files) require_not_needed(line, file);
  const bool is_other = !other_volume(*volume.known, look_at(files)).empty();
  // Each check reads them anew.
  volume.removal = Removal{files, UnchangedFiles(files), UnchangedFiles({volume.output})};
  return is_other ? archive::Input::other : archive::Input::unread;
}

void RemovalPass::compare_options(Volume& volume, archive::Facts& facts) const {
  const ManifestLine& line = volume.line;
  const auto source = open_volume(line.input, encoding_of(volume.known->options, options_.run).source);
  volume.difference = difference_of(*volume.known, line.options, options_.run, *source);
  facts.options = volume.difference.empty() ? archive::Options::same : archive::Options::different;
}

/// What the volume has besides its samples must come back as it is now.
void RemovalPass::require_kept_files(const Volume& volume, const VolumeSource& source) const {
  const std::string& input = volume.line.input;
  const TagBricks file(std::make_shared<FileSource>(volume.output));
  if (file.sizes().envelope == 0)
    throw BrokenInput("{}: {} does not keep its files; it is kept", input, volume.output);
  const SourceComparison found = compare_source_files(file, source, resources_.threads);
  if (!found.is_same)
    throw BrokenInput("{}: has changed since it was encoded: {}; it is kept", input, found.difference);
  if (!found.compression.empty())
    throw UsageError("{}: {}; it is kept", input, change_of_restoring(found.compression));
}

/// Compares the output with what was written, and with the volume. Throws if too much would be lost with the
/// volume.
void RemovalPass::verify(const Volume& volume, archive::Facts& facts) {
  const std::string &output = volume.output, &input = volume.line.input;
  const KnownOutput& known = *volume.known;
  const Encoding was = encoding_of(known.options, options_.run);
  SourceDescription source = was.source;
  if (!is_as_written(known, output)) {
    facts.check = archive::Check::damaged;
    return note_newer_records(known_, volume.line, output, known.record, facts);
  }
  // The current options do not matter, only those of the existing output.
  const double max_error = TagReader(output).parameters().max_error;
  const std::time_t now = std::time(nullptr);
  const auto original = open_volume(input, source);
  source.known = known_volume(*original, now);
  require_replaceable(
      input, {max_error, known.headerless, options_.trust_description, why_not_understood(original->facts())},
      "it is kept");
  require_files_come_back(input, source, original->facts(), !was.options.strip, "it is kept");
  // The bound is not enough of a check: a later version of the original may be within it, too.
  if (checksum_text(checksum_of_samples(*open_volume(input, source))) != known.input_checksum) {
    facts.input = archive::Input::changed;
    return;
  }
  Ranks alone;
  const VerifyResult found = verify_file(
      alone, {.input = output,
              .original = input,
              .source = source,
              .resources = resources_,
              .progress = [&](std::uint64_t done, std::uint64_t total) { meter_.update(done, total); }});
  if (const std::string lost = lost_structure(found.header, found.index.total); !lost.empty())
    throw UsageError("{}: {}; it is kept", input, lost);
  require_kept_files(volume, *original);
  if (info_of_volume(original->facts(), 0).metadata != found.header.metadata) {
    const std::string version = ordered_json::parse(known.record).value("version", "");
    if (version != TAGRID_VERSION)
      throw BrokenInput(
          "{}: was encoded by tagrid {}, which read its metadata differently than {} does; it is kept; to "
          "encode it again, run with -f, without --skip-done, and a list of such volumes alone",
          input, version, TAGRID_VERSION);
    throw BrokenInput(input + ": its header has changed since it was encoded; it is kept");
  }
  facts.input = archive::Input::touched;
  facts.check = archive::Check::good;
}

}  // namespace tagrid
