#include "tools/archive/encoding_pass.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/file_bytes.h"
#include "io/formats/nrrd/geometry.h"
#include "io/formats/table/open_volume.h"
#include "io/system/files.h"
#include "io/tag/bricks.h"
#include "io/tag/file.h"
#include "io/volume/one_of_volumes.h"
#include "pipeline/job/settle.h"
#include "pipeline/memory/plan.h"
#include "pipeline/restore/restore.h"
#include "pipeline/run/run.h"
#include "tools/archive/input_removal.h"
#include "tools/archive/manifest.h"
#include "tools/archive/settings_used.h"
#include "tools/report/damage.h"
#include "tools/report/failure.h"
#include "tools/report/info.h"
#include "tools/report/process.h"
#include "tools/report/report.h"

namespace tagrid {

namespace {

using nlohmann::ordered_json;

struct Volume {
  std::string name, input, output;
  std::string output_name;  ///< its path below the directory of the outputs
  std::string base;         ///< from which its record names files
  Encoding asked;
  std::vector<InputFile> files;
  bool headerless = false;
  std::unique_ptr<UnchangedFiles> watched;  ///< the same files
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
  record["status"] = "ok";
}

/// Why the files do not come back byte for byte; "" if they do. `why_lost`: the reasons besides the samples.
std::string why_not_restorable(const std::string& why_lost, const CodingParameters& parameters) {
  if (!why_lost.empty() || parameters.is_exact()) return why_lost;
  return parameters.max_error < 0 ? "nothing bounds the error of its samples"
                                  : fmt::format("its samples are kept within {}", parameters.max_error);
}

UsageError only_copy(const Volume& volume, const std::string& why) {
  return usage_error(
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

/// Throws BrokenInput if the name of a volume, such as that of a series, means another volume than was
/// encoded. That is never what replaces the output.
void require_same_volume(const KnownOutput& known, const Volume& volume) {
  if (const std::string others = other_volume(known, volume.files); !others.empty())
    throw broken_input_error(
        "{}: is another volume than the one that was encoded ({}); {} has that one and stays; choose another "
        "name (output=NAME)",
        volume.input, others, volume.output);
}

/// Throws BrokenInput if the volume is not the one that was encoded.
void require_unchanged(const KnownOutput& known, const Volume& volume, VolumeSource& source) {
  if (const std::string change = change_of(known, volume.files, source); !change.empty())
    throw broken_input_error(
        "{}: has changed since it was encoded ({}); {} has the earlier volume and stays; give -f to replace "
        "it",
        volume.input, change, volume.output);
}

/// True if the records say that the original of an output was removed, or if a line that cannot be
/// read may say it.
bool was_original_removed(const KnownOutputs& known, const std::string& output_name) {
  const KnownOutput* last = known.find(output_name);
  return (last && last->state == KnownOutput::State::removed) || !known.possibly_newer(output_name).empty();
}

/// Throws UsageError if another run may have removed the original of the output since this one read the records.
void require_no_only_copy(const EncodingPass& pass, const Volume& volume) {
  pass.known.read_more();
  if (was_original_removed(pass.known, volume.output_name) && status_of_name(volume.output))
    throw only_copy(volume, "another run removed it in the meantime");
}

void encode(const EncodingPass& pass, const Volume& volume, bool overwrite, ordered_json& record) {
  const RunOptions& run = pass.options.run;
  if (!is_regular_output(volume.output))
    throw UsageError(volume.output + ": exists and is not a regular file");
  const SourceDescription& source = volume.asked.source;
  if (source.raw) add_warning(volume, doubt_of_description(volume.input, *source.raw), record);
  const Progress progress = [&](std::uint64_t done, std::uint64_t total) {
    if (pass.stop) throw Stopped();
    pass.meter.update(done, total);
  };
  Ranks alone;
  FinishedEncode encoded = encode_volume(alone, {.input = volume.input,
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
                                                 .before_name = [&] { require_no_only_copy(pass, volume); }});
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
void adopt(const EncodingPass& pass, const Volume& volume, bool was_removed, ordered_json& record) {
  const SourceDescription& source = volume.asked.source;
  try {
    const std::uint64_t output_checksum = checksum_of_file(volume.output);
    const auto original = open_volume(volume.input, source);
    const ResolvedOptions options = in_samples(volume.asked.options, original->facts());
    const EncodePlan plan = plan_encoding(options.parameters, pass.resources, original->traits().any_rows,
                                          {.besides = original->traits().memory});
    const EncodeJob job = settle(options, plan, *original);
    const VerifyResult found = require_result({.input = volume.input,
                                               .source = source,
                                               .output = volume.output,
                                               .options = volume.asked.options,
                                               .keep_files = true},
                                              job, *original, pass.resources);
    const TagBricks file(std::make_shared<FileSource>(volume.output));
    const bool keeps_files = file.sizes().envelope > 0;
    const std::string compression = compression_in(volume.output, file.beginning_of_envelope());
    const std::string why_lost = volume.asked.options.strip ? "only the samples were wanted"
                                 : keeps_files && compression.empty()
                                     ? ""
                                     : source_files(original->facts()).why_not_restorable();
    describe(volume, found.header, found.index, found.bytes_in,
             text_of_key(original->info().nrrd_fields, lossy_source_key),
             why_not_restorable(why_lost, job.parameters()),
             checksum_of_samples(*open_volume(volume.input, source)), output_checksum, record);
    record["compared"] = true;
  } catch (const BrokenInput& broken) {
    if (was_removed) throw only_copy(volume, words_of(broken));
    throw usage_error("{}: already exists, and is not known to be made from {} ({}); give -f to overwrite it",
                      volume.output, volume.input, words_of(broken));
  }
}

}  // namespace

void encode_line(const EncodingPass& pass, const ManifestLine& line, ordered_json& record) {
  const ConversionOptions& options = pass.options;
  Volume volume{line.name,
                line.input,
                (std::filesystem::path(options.output_dir) / line.output).string(),
                line.output,
                base_of_records(options.output_dir, line),
                encoding_of(line.options, options.run),
                {},
                false,
                nullptr};
  const KnownOutput* last = pass.known.find(line.output);
  const bool was_removed = was_original_removed(pass.known, line.output);
  const KnownOutput* known = options.skip_done ? last : nullptr;
  const bool is_there = known && has_written_size(*known, volume.output);
  ordered_json skipped = record;
  if (last && skip_removed(*last, volume.input, volume.output, options.run, skipped)) {
    if (!options.skip_done)
      throw usage_error(
          "{}: was removed by --remove-verified, and {} is what it was encoded to; give --skip-done to leave "
          "out such volumes, or get the originals back with tagrid restore --records {}",
          volume.input, volume.output, word_of_command(options.output_dir));
    record = std::move(skipped);
    return;
  }
  require_own_folders(options.output_dir, line.output);
  require_file_or_folder(volume.input);
  require_lasting_choice(volume.input, volume.asked.source);
  const auto source = open_volume(volume.input, volume.asked.source);
  volume.files = look_at(source->files());
  volume.watched = std::make_unique<UnchangedFiles>(source->files());
  volume.headerless = source->facts().headerless;
  const bool is_ours = known && !was_removed && known->input == volume.input;
  if (is_ours && status_of_name(volume.output)) require_same_volume(*known, volume);
  if (is_there && is_ours && known->state == KnownOutput::State::ok) {
    const std::string difference = difference_of(*known, line.options, options.run, *source);
    if (difference.empty() && known->input_files == volume.files) return skip(*known, record);
    if (!difference.empty() && !options.overwrite)
      throw usage_error(
          "{}: was encoded with other options: {}; to encode it again, run with -f and a list of such "
          "volumes alone",
          volume.output, difference);
  }
  // The source may have been damaged since, and the output may be all that is left of it.
  if (is_ours && !options.overwrite && known->input_files != volume.files && status_of_name(volume.output)) {
    require_unchanged(*known, volume, *source);
    if (is_there && known->state == KnownOutput::State::ok) return adopt(pass, volume, was_removed, record);
  }
  // An output may have no record: a run was killed before it recorded it, or records were lost. It may also
  // be all that is left of a volume, which no option replaces.
  const bool replace = !was_removed && (options.overwrite || is_ours);
  if (!replace && status_of_name(volume.output)) {
    if (options.skip_done) return adopt(pass, volume, was_removed, record);
    if (was_removed) throw only_copy(volume, "--skip-done compares them");
    if (is_regular_output(volume.output)) {
      // Nothing was encoded, so this says nothing against the record of an output that these options give.
      if (last && last->state == KnownOutput::State::ok && last->input == volume.input &&
          difference_of(*last, line.options, options.run, *source).empty()) {
        add_output(*last, record);
        record["status"] = "exists";
      }
      throw UsageError(volume.output +
                       ": already exists; give --skip-done to leave out volumes that are done, or -f to "
                       "encode them again");
    }
  }
  make_own_folders(options.output_dir, line.output);
  try {
    encode(pass, volume, replace, record);
  } catch (const UsageError& error) {
    const bool appeared = error.detail().problem == Problem::output_exists;
    if (!appeared || replace || !is_regular_output(volume.output)) throw;
    adopt(pass, volume, was_removed, record);
    if (!options.run.quiet)
      say_line(volume.output + ": another run created it in the meantime; it was compared with its volume");
  }
}

}  // namespace tagrid
