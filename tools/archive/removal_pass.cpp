#include "tools/archive/removal_pass.h"

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
#include "io/volume/one_of_volumes.h"
#include "pipeline/restore/restore.h"
#include "pipeline/run/run.h"
#include "tools/archive/input_removal.h"
#include "tools/archive/manifest.h"
#include "tools/archive/settings_used.h"
#include "tools/options/encoding_options.h"
#include "tools/report/report.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

std::string canonical_name(const std::string& path) {
  std::error_code error;
  const fs::path canonical = fs::weakly_canonical(path, error);
  return error ? path : canonical.string();
}

/// Adds all files below a directory that can be seen.
void add_files_below(const std::string& folder, std::vector<std::string>& all) {
  std::vector<FolderEntry> entries;
  files().list(folder, entries);
  for (const FolderEntry& entry : entries) {
    const std::string path = (fs::path(folder) / entry.name).string();
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
                         Resources resources, const KnownOutputs& known, ListMeter& meter)
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
      unknown_.push_back({line.input, fs::path(canonical_name(line.input)).parent_path().string(),
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
    if ((is_data_file && fs::path(name).parent_path() == other.folder) ||
        other.beginning.find(fs::path(name).filename().string()) != std::string::npos)
      throw usage_error(
          "{}: may also belong to {}, which cannot be opened ({}); it is kept; repair that volume or, if "
          "nobody needs it, remove its header and its line in the list",
          file, other.input, other.why);
}

std::string RemovalPass::output_path(const ManifestLine& line) const {
  return (fs::path(options_.output_dir) / line.output).string();
}

std::optional<Removal> RemovalPass::verified(const ManifestLine& line, ordered_json& record) {
  const KnownOutput* known = known_.find(line.output);
  if (known && skip_removed(*known, line.input, output_path(line), options_.run, record)) return std::nullopt;
  if (!known) require_file_or_folder(line.input);  // what is not there is not kept
  record["status"] = "kept";
  const std::string failure = known_.last_failure(line.output);
  if (!known && !failure.empty())
    throw usage_error("{}: its last encoding failed: {}; it is kept", line.input, failure);
  if (!known)
    throw usage_error(
        "{}: no record says that it was encoded to {}; it is kept; give the list and the options of its "
        "encoding",
        line.input, output_path(line));
  if (known->input != line.input)
    throw usage_error(
        "{}: {} is recorded as made from {}; if this is the same volume, --skip-done records it; otherwise "
        "choose another name (output=NAME)",
        line.input, line.output, known->input);
  add_output(*known, record);
  if (!failure.empty())
    throw usage_error(
        "{}: its last encoding failed: {}; it is kept until a run with --skip-done and the options of its "
        "encoding succeeds",
        line.input, failure);
  if (const std::string line_of_none = known_.possibly_newer(line.output); !line_of_none.empty())
    throw usage_error(
        "{}: {}, and may say that its encoding failed; it is kept until a run with --skip-done succeeds",
        line.input, line_of_none);
  record["options"] = json_of(known->options);
  require_own_folders(options_.output_dir, line.output);
  std::vector<std::string> files = removable(line, *known);
  // Each check reads them anew.
  Removal removal{files, UnchangedFiles(files), UnchangedFiles({output_path(line)})};
  require_same_options(line, *known);
  verify(line, *known, record);
  return removal;
}

void RemovalPass::require_same_options(const ManifestLine& line, const KnownOutput& known) const {
  const auto volume = open_volume(line.input, encoding_of(known.options, options_.run).source);
  if (const std::string difference = difference_of(known, line.options, options_.run, *volume);
      !difference.empty())
    throw usage_error(
        "{}: was encoded with other options: {}; the original is kept; give the options of its encoding, or "
        "encode it again",
        line.input, difference);
}

std::vector<std::string> RemovalPass::removable(const ManifestLine& line, const KnownOutput& known) {
  require_file_or_folder(line.input);
  const Encoding was = encoding_of(known.options, options_.run);
  auto files = removable_volume(line.input, was.source, output_path(line), headers_, "it is kept");
  for (const std::string& file : files) require_not_needed(line, file);
  if (const std::string others = other_volume(known, look_at(files)); !others.empty())
    throw broken_input_error(
        "{}: is another volume than the one that was encoded ({}); it is kept; to encode it, choose another "
        "name (output=NAME)",
        line.input, others);
  return files;
}

/// What the volume has besides its samples must come back as it is now.
void RemovalPass::require_kept_files(const ManifestLine& line, const VolumeSource& volume) const {
  const TagBricks file(std::make_shared<FileSource>(output_path(line)));
  if (file.sizes().envelope == 0)
    throw broken_input_error("{}: {} does not keep its files; it is kept", line.input, output_path(line));
  const SourceComparison found = compare_source_files(file, volume, resources_.threads);
  if (!found.is_same)
    throw broken_input_error("{}: has changed since it was encoded: {}; it is kept", line.input,
                             found.difference);
  if (!found.compression.empty())
    throw usage_error("{}: its samples are compressed ({}), and come back uncompressed; it is kept",
                      line.input, found.compression);
}

void RemovalPass::verify(const ManifestLine& line, const KnownOutput& known, ordered_json& record) const {
  const std::string output = output_path(line);
  const Encoding was = encoding_of(known.options, options_.run);
  const SourceDescription& source = was.source;
  if (!is_as_written(known, output)) {
    const KnownOutputs now(options_.output_dir);
    if (const KnownOutput* newest = now.find(line.output); newest && newest->record != known.record)
      throw BrokenInput(output + ": was encoded again by another run in the meantime; the original is kept");
    record["status"] = "damaged";
    throw BrokenInput(output + ": has changed since it was written; the original is kept");
  }
  // The current options do not matter, only those of the existing output.
  const double max_error = TagReader(output).parameters().max_error;
  const auto volume = open_volume(line.input, source);
  require_replaceable(
      line.input,
      {max_error, known.headerless, options_.trust_description, why_not_understood(volume->facts())},
      "it is kept");
  require_files_come_back(line.input, volume->facts(), !was.options.strip, "it is kept");
  // The bound is not enough of a check: a later version of the original may be within it, too.
  if (checksum_text(checksum_of_samples(*open_volume(line.input, source))) != known.input_checksum)
    throw BrokenInput(line.input +
                      ": has changed since it was encoded; it is kept; --skip-done -f encodes it again");
  Ranks alone;
  const VerifyResult found = verify_file(
      alone, {.input = output,
              .original = line.input,
              .source = source,
              .resources = resources_,
              .progress = [&](std::uint64_t done, std::uint64_t total) { meter_.update(done, total); }});
  if (const std::string lost = lost_structure(found.header, found.index.total); !lost.empty())
    throw usage_error("{}: {}; it is kept", line.input, lost);
  require_kept_files(line, *volume);
  if (info_of_volume(volume->facts(), 0).nrrd_fields != found.header.nrrd_fields) {
    const std::string version = ordered_json::parse(known.record).value("version", "");
    if (version != TAGRID_VERSION)
      throw broken_input_error(
          "{}: was encoded by tagrid {}, which read its metadata differently than {} does; it is kept; to "
          "encode it again, run with -f, without --skip-done, and a list of such volumes alone",
          line.input, version, TAGRID_VERSION);
    throw BrokenInput(line.input + ": its header has changed since it was encoded; it is kept");
  }
}

}  // namespace tagrid
