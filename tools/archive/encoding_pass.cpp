#include "tools/archive/encoding_pass.h"

#include <fmt/format.h>

#include <cerrno>
#include <ctime>
#include <filesystem>
#include <memory>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/file_bytes.h"
#include "io/formats/table/open_volume.h"
#include "io/metadata/loss.h"
#include "io/system/files.h"
#include "io/tag/bricks.h"
#include "io/tag/file.h"
#include "io/text/paths.h"
#include "io/volume/one_of_volumes.h"
#include "pipeline/memory/plan.h"
#include "pipeline/restore/restore.h"
#include "pipeline/run/run.h"
#include "pipeline/settle/read_again.h"
#include "tools/archive/input_removal.h"
#include "tools/archive/manifest.h"
#include "tools/archive/removal_table.h"
#include "tools/archive/settings_used.h"
#include "tools/archive/subject.h"
#include "tools/report/damage.h"
#include "tools/report/failure.h"
#include "tools/report/info.h"
#include "tools/report/process.h"
#include "tools/report/report.h"

namespace tagrid {

namespace {

using nlohmann::ordered_json;

using archive::Action;

struct Volume {
  const ManifestLine& line;
  std::string name, input, output;
  std::string base;  ///< from which its record names files
  Encoding asked;
  // Since it was opened.
  std::unique_ptr<VolumeSource> source = nullptr;
  std::vector<InputFile> files = {};
  bool headerless = false;
  ordered_json subject = nullptr;                     ///< null without a key file
  std::unique_ptr<UnchangedFiles> watched = nullptr;  ///< the same files
  // Since it was compared with the record.
  std::string difference = "";  ///< of the options
  std::string change = "";      ///< of the volume
};

/// Adds a warning to the record, with the name of the volume in the list.
void add_warning(const Volume& volume, std::string_view warning, ordered_json& record) {
  if (warning.empty()) return;
  const std::string input = volume.input + ": ";
  if (warning.starts_with(input)) warning.remove_prefix(input.size());
  record["warnings"].push_back(text_of_name(fmt::format("{}: {}", volume.name, warning)));
}

/// Adds the description of an output to its record, which says from now on that the output is good.
void describe(const Volume& volume, const TagHeader& header, const TagIndex& index, std::uint64_t bytes_out,
              const std::string& lossy_source, const std::string& why_not_restorable,
              std::uint64_t input_checksum, std::uint64_t output_checksum, ordered_json& record) {
  const CodingParameters& parameters = header.parameters;
  std::uint64_t bytes_in = 0;
  for (const InputFile& file : volume.files) bytes_in += file.bytes;
  record["dims"] = {parameters.dims.x, parameters.dims.y, parameters.dims.z};
  record["type"] = name_of(parameters.type);
  record["settings"] = settings_json(parameters);
  record["bytes_in"] = bytes_in;
  record["bytes_out"] = bytes_out;
  record["restorable"] = why_not_restorable.empty();
  record["why_not_restorable"] = json_text_or_null(why_not_restorable);
  record["lossy_source"] = json_text_or_null(lossy_source);
  record["input_files"] = json_of(volume.files, volume.base);
  record["headerless"] = volume.headerless;
  record["input_xxh3"] = checksum_text(input_checksum);
  record["output_xxh3"] = checksum_text(output_checksum);
  record["achieved"] = achieved_json(header, index.total);
  // Of the volume that the output has: one that fails must not describe the output of another.
  if (!volume.subject.is_null()) record[subject_key] = volume.subject;
  record["status"] = "ok";
}

/// Why the files do not come back byte for byte; "" if they do. `why_lost`: the reasons besides the samples.
std::string why_not_restorable(const std::string& why_lost, const CodingParameters& parameters) {
  if (!why_lost.empty() || parameters.is_exact()) return why_lost;
  return parameters.max_error < 0 ? "nothing bounds the error of its samples"
                                  : fmt::format("its samples are kept within {}", parameters.max_error);
}

UsageError only_copy(const Volume& volume, const std::string& why) {
  return UsageError(
      "{}: may be the only copy of a volume whose original was removed, and {} is not known to be that "
      "original ({}); choose another name (output=NAME), or restore the original with tagrid restore "
      "--records DIR -f, and give the options of its encoding",
      volume.output, volume.input, why);
}

/// "its samples differ", "19 files instead of 20"; "" if at most the times of its files are new.
std::string change_of(const KnownOutput& known, const std::vector<InputFile>& files, VolumeSource& source) {
  const ordered_json earlier = ordered_json::parse(known.record);
  const std::string now = described(info_of_volume(source.facts(), 0).dims, source.info().type);
  const auto dims = earlier.find("dims"), type = earlier.find("type");
  if (dims != earlier.end() && dims->is_array() && dims->size() == 3 && type != earlier.end() &&
      type->is_string()) {
    const std::string was = fmt::format("{} x {} x {} {}", (*dims)[0].dump(), (*dims)[1].dump(),
                                        (*dims)[2].dump(), type->get<std::string>());
    if (now != was) return fmt::format("it is {} instead of {}", now, was);
  }
  if (files.size() != known.input_files.size())
    return fmt::format("{} files instead of {}", files.size(), known.input_files.size());
  for (std::size_t i = 0; i < files.size(); ++i) {
    const InputFile &file = files[i], &was = known.input_files[i];
    if (file.path != was.path) return fmt::format("{} instead of {}", file.path, was.path);
    if (file.bytes != was.bytes)
      return fmt::format("{} has {} bytes instead of {}", file.path, file.bytes, was.bytes);
  }
  return checksum_text(checksum_of_samples(source)) == known.input_checksum ? "" : "its samples differ";
}

/// Opens the volume, and compares its files with those of the record.
archive::Input look(const EncodingPass& pass, Volume& volume) {
  require_own_folders(pass.options.output_dir, volume.line.output);
  require_file_or_folder(volume.input);
  require_lasting_choice(volume.input, volume.asked.source);
  const std::time_t now = std::time(nullptr);
  volume.source = open_volume(volume.input, volume.asked.source);
  volume.files = look_at(volume.source->files());
  volume.watched = std::make_unique<UnchangedFiles>(volume.source->files());
  volume.asked.source.known = known_volume(*volume.source, now);
  volume.headerless = volume.source->facts().headerless;
  // For those who look for a patient with the key file: the output may not have these any more.
  if (!pass.options.keys.empty()) volume.subject = json_of(subject_of(volume.source->info().metadata));
  const KnownOutput* known = pass.known.find(volume.line.output);
  if (known != nullptr && !other_volume(*known, volume.files).empty()) return archive::Input::other;
  return known != nullptr && known->input_files == volume.files ? archive::Input::same
                                                                : archive::Input::unread;
}

/// Throws the reason why a line fails. If it is that the output exists as asked, the record describes it.
[[noreturn]] void fail(Action reason, const EncodingPass& pass, const Volume& volume, ordered_json& record) {
  const KnownOutput* known = pass.known.find(volume.line.output);
  switch (reason) {
    case Action::missing_copy:
      throw missing_copy(volume.output);
    case Action::was_removed:
      throw UsageError(
          "{}: was removed by --remove-verified, and {} is what it was encoded to; give --skip-done to leave "
          "out such volumes, or get the originals back with tagrid restore --records {}",
          volume.input, volume.output, word_of_command(pass.options.output_dir));
    case Action::missing:
      throw world_error("cannot open", volume.input, ENOENT);
    case Action::irregular:
      throw UsageError(volume.output + ": exists and is not a regular file");
    case Action::only_copy:
      throw only_copy(volume, "--skip-done compares them");
    case Action::new_only_copy:
      throw only_copy(volume, "another run removed it in the meantime");
    case Action::other_volume:
      throw BrokenInput(
          "{}: is another volume than the one that was encoded ({}); {} has that one and stays; choose "
          "another name (output=NAME)",
          volume.input, other_volume(*known, volume.files), volume.output);
    case Action::other_options:
      throw UsageError(
          "{}: was encoded with other options: {}; to encode it again, run with -f and a list of such "
          "volumes alone",
          volume.output, volume.difference);
    case Action::changed:
      throw BrokenInput(
          "{}: has changed since it was encoded ({}); {} has the earlier volume and stays; give -f to "
          "replace it",
          volume.input, volume.change, volume.output);
    case Action::found_damaged:
      throw BrokenInput(
          "{}: the last check found it damaged; repair it with tagrid archive repair {}, or remove it to "
          "encode {} again",
          volume.output, word_of_command(pass.options.output_dir), volume.input);
    case Action::exists_as_asked:
      add_output(*known, record);
      record["status"] = "exists";
      [[fallthrough]];
    default:
      throw UsageError(volume.output +
                       ": already exists; give --skip-done to leave out volumes that are done, or -f to "
                       "encode them again");
  }
}

/// Throws if other runs have made the output, or have removed its original, since this one decided.
void require_name(const EncodingPass& pass, const Volume& volume, archive::Facts facts,
                  ordered_json& record) {
  const std::string before = pass.known.record_of(volume.line.output);
  note_newer_records(pass.known, volume.line, volume.output, before, facts);
  facts.check = archive::Check::good;
  switch (const Action action = decide(archive::encoding_table(), facts)) {
    case Action::name:
      return;
    case Action::adopt:
      throw UsageError(volume.output + ": already exists", Problem::output_exists);
    default:
      fail(action, pass, volume, record);
  }
}

void encode(const EncodingPass& pass, const Volume& volume, bool overwrite, const archive::Facts& facts,
            ordered_json& record) {
  const RunOptions& run = pass.options.run;
  const SourceDescription& source = volume.asked.source;
  if (source.raw) add_warning(volume, doubt_of_description(volume.input, *source.raw), record);
  const Progress progress = [&](std::uint64_t done, std::uint64_t total) {
    if (pass.stop) throw Stopped();
    pass.syncs.sync_if_due();
    pass.meter.update(done, total);
  };
  Ranks alone;
  FinishedEncode encoded =
      encode_volume(alone, {.input = volume.input,
                            .source = source,
                            .output = volume.output,
                            .overwrite = overwrite,
                            .options = volume.asked.options,
                            .resources = pass.resources,
                            .progress = progress,
                            .searching = progress,
                            .keep_files = true,
                            .verified = true,
                            .before_copy = tell_of_copy(run),
                            .before_name = [&] { require_name(pass, volume, facts, record); }});
  if (pass.stop) throw Stopped();
  const EncodeResult& result = encoded.result;
  verify_encoding(volume.input, source, result.temporary, *volume.watched, pass.resources);
  const std::uint64_t input_checksum = checksum_of_samples(*open_volume(volume.input, source));
  volume.watched->require();
  const std::uint64_t output_checksum = checksum_of_file(result.temporary);
  encoded.commit();
  for (const std::string& warning : warnings_of_encoding(volume.input, volume.asked.options, result))
    add_warning(volume, warning, record);
  if (!result.reason_of_bound.empty() && run.is_verbose()) say("{}: {}", volume.name, result.reason_of_bound);
  describe(volume, result.header, result.index, result.file_bytes, result.lossy_source,
           why_not_restorable(result.why_not_restorable, result.header.parameters), input_checksum,
           output_checksum, record);
  if (!result.reason_of_bound.empty()) record["settings"]["reason_of_max_error"] = result.reason_of_bound;
}

/// Describes an existing output. Throws UsageError if it was not made from the volume with these options.
void adopt(const EncodingPass& pass, const Volume& volume, bool is_only_copy, ordered_json& record) {
  const SourceDescription& source = volume.asked.source;
  try {
    const std::uint64_t output_checksum = checksum_of_file(volume.output);
    std::unique_ptr<VolumeSource> original = open_volume(volume.input, source);
    const SourceTraits& traits = original->traits();
    const EncodeJob job = settle_any(volume.asked.options, original,
                                     {.resources = pass.resources,
                                      .any_rows = traits.any_rows,
                                      .encodes = false,
                                      .needs = {.besides = traits.memory}});
    const VerifyResult found = require_result({.input = volume.input,
                                               .source = source,
                                               .output = volume.output,
                                               .options = volume.asked.options,
                                               .keep_files = true},
                                              job, *original, pass.resources);
    const TagBricks file(std::make_shared<FileSource>(volume.output));
    const bool keeps_files = file.sizes().envelope > 0;
    const std::string compression =
        keeps_files ? compression_in(volume.output, file.beginning_of_envelope()) : "";
    const std::string why_lost = volume.asked.options.strip ? "only the samples were wanted"
                                 : keeps_files && compression.empty()
                                     ? ""
                                     : source_files(original->facts()).why_not_restorable();
    describe(volume, found.header, found.index, found.bytes_in,
             original->info().metadata.text_of(lossy_source_key),
             why_not_restorable(why_lost, job.parameters()),
             checksum_of_samples(*open_volume(volume.input, source)), output_checksum, record);
    record["compared"] = true;
  } catch (const BrokenInput& broken) {
    if (is_only_copy) throw only_copy(volume, words_of(broken));
    throw UsageError("{}: already exists, and is not known to be made from {} ({}); give -f to overwrite it",
                     volume.output, volume.input, words_of(broken));
  }
}

/// Encodes the volume. Returns false if another run made the output in the meantime.
bool encode_alone(const EncodingPass& pass, const Volume& volume, bool overwrite, const archive::Facts& facts,
                  ordered_json& record) {
  make_own_folders(pass.options.output_dir, volume.line.output, &pass.syncs);
  try {
    encode(pass, volume, overwrite, facts, record);
    return true;
  } catch (const UsageError& error) {
    if (error.detail().problem != Problem::output_exists) throw;
    return false;
  }
}

}  // namespace

void encode_line(const EncodingPass& pass, const ManifestLine& line, ordered_json& record) {
  const ConversionOptions& options = pass.options;
  Volume volume{.line = line,
                .name = line.name,
                .input = line.input,
                .output = path_in(options.output_dir, line.output),
                .base = base_of_records(options.output_dir, line),
                .asked = encoding_of(line.options, options.run)};
  archive::Facts facts{.skip_done = options.skip_done, .overwrite = options.overwrite};
  note_records(pass.known, line, volume.output, facts);
  facts.input = input_of(pass.known, line, options.run);
  for (;;) {
    const KnownOutput* known = pass.known.find(line.output);
    switch (const Action action = decide(archive::encoding_table(), facts)) {
      case Action::look:
        facts.input = look(pass, volume);
        break;
      case Action::compare_options:
        volume.difference = difference_of(*known, line.options, options.run, *volume.source);
        facts.options = volume.difference.empty() ? archive::Options::same : archive::Options::different;
        break;
      case Action::compare_samples:
        volume.change = change_of(*known, volume.files, *volume.source);
        facts.input = volume.change.empty() ? archive::Input::touched : archive::Input::changed;
        break;
      case Action::skip:
        return skip(*known, record);
      case Action::encode:
      case Action::replace:
        if (encode_alone(pass, volume, action == Action::replace, facts, record)) return;
        note_records(pass.known, line, volume.output, facts);
        if (facts.output != archive::Output::irregular) facts.output = archive::Output::appeared;
        break;
      case Action::adopt:
      case Action::prove:
        adopt(pass, volume, action == Action::prove, record);
        if (facts.output == archive::Output::appeared && !options.run.quiet)
          say_line(volume.output +
                   ": another run created it in the meantime; it was compared with its volume");
        return;
      default:
        fail(action, pass, volume, record);
    }
  }
}

}  // namespace tagrid
