#include "pipeline/parts/encode_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "io/bytes/checksum.h"
#include "io/files/errors.h"
#include "io/files/file_bytes.h"
#include "io/files/system_call.h"
#include "io/files/temporaries.h"
#include "io/files/unchanged_files.h"
#include "io/formats/open_volume.h"
#include "io/nrrd/geometry.h"
#include "io/parts/part_folder.h"
#include "io/tag/bricks.h"
#include "pipeline/encode/row_encoder.h"
#include "pipeline/job/plain_bound.h"
#include "pipeline/memory/plan.h"
#include "pipeline/parts/part_work.h"
#include "pipeline/parts/run_settings.h"
#include "pipeline/parts/source_contents.h"
#include "pipeline/parts/work_orders.h"
#include "pipeline/restore/restore.h"

namespace tagrid {
namespace {

constexpr Setting resume = {"resume", "the earlier run"};

Bytes content_of(const std::string& path) {
  FileBytes file(path);
  Bytes bytes(file.size().value_or(0));
  bytes.resize(file.read(bytes.data(), bytes.size()));
  return bytes;
}

void write_file(const std::string& path, const Bytes& bytes) {
  OutputFile file(path, true);
  file.write(bytes);
  file.commit();
}

// After this, the run can no longer be continued.
void remove_record(PartFolder& folder) {
  folder.remove_parts();
  end_signals_with(-1, "");
  folder.remove();
}

// The output of a run, which is assembled in the folder of its parts.
struct FileOfParts {
  std::unique_ptr<PartFolder> folder;
  std::unique_ptr<OutputFile> file;  // none if an earlier run has already given it its name

  void commit() {
    if (file) file->commit();
    remove_record(*folder);
  }
};

class RunInParts {
 public:
  RunInParts(Ranks& ranks, const EncodeRun& run)
      : ranks_(ranks), run_(run), volume_(open_volume(run.input, run.source)), files_(volume_->files()) {
    OptionsForSamples given = for_samples(run.options, volume_->facts());
    options_ = std::move(given.options);
    reason_of_bound_ = std::move(given.reason);
    for (const std::string& file : volume_->files()) refuse_same_file(file, run.output);
    for (const std::string& file : volume_->files()) record_.inputs.push_back(identity_of(file));
    record_.program = run.program;
  }

  FinishedEncode finish() {
    // Fails early if the output may not be written. A run that was interrupted just before its end may have
    // written it already, so a run that continues checks later.
    if (!run_.resume || !status_of(part_folder_of(run_.output))) check_output(run_.output, run_.overwrite);
    // Checked before anything is read: a limit that cannot be kept is reported at once.
    plan_ = plan_encoding(
        parameters_but_scale(options_, volume_->info()), of_this_rank(ranks_, run_.resources), true,
        memory_besides_parts(*volume_) + memory_of_files(run_, *volume_), original_access(run_, *volume_));
    const auto output = std::make_shared<FileOfParts>();
    output->folder = std::make_unique<PartFolder>(run_.output, run_.resume);
    PartFolder& folder = *output->folder;
    const bool goes_on = run_.resume && read_earlier_record(folder);
    if (!goes_on) check_output(run_.output, run_.overwrite);
    settle(goes_on ? with_earlier_findings(options_) : options_);
    if (goes_on) {
      require_same_run(folder);
      // Only the record of the run remains to be removed.
      if (is_finished()) return {finished_result(), output};
      check_output(run_.output, run_.overwrite);
      folder.remove_unfinished();
    } else if (run_.resume) {
      folder.clear();
    }
    record_bytes_ = serialize_record(record_);
    write_file(folder.record(), record_bytes_);
    const PartOrder order{run_.input,    run_.source,    folder.path(),
                          record_bytes_, run_.resources, code_after_signal()};
    send_order(ranks_, order);
    if (goes_on && run_.goes_on) tell_of_parts(folder);
    make_parts(ranks_, order, run_.progress);
    return {assemble(*output), output};
  }

 private:
  const CodingParameters& parameters() const { return header_.parameters; }

  bool read_earlier_record(const PartFolder& folder) {
    if (!status_of(folder.record())) return false;
    const Status status = parse_record(content_of(folder.record()), earlier_);
    if (!status.ok())
      throw UsageError(Sentence{"{}: {} {}; {}", {resume, folder.record(), status.what(), advice(folder)}});
    return true;
  }

  static std::string advice(const PartFolder& folder) {
    return fmt::format("remove {} to start again", folder.path());
  }

  // What the earlier run found in the same samples need not be searched again.
  EncodeOptions with_earlier_findings(EncodeOptions options) {
    TagHeader header;
    std::uint64_t checksum;
    if (!inputs_are_the_same() || !parse_header(earlier_.header, header, checksum).ok()) return options;
    const CodingParameters& found = header.parameters;
    const bool from_data = options.range_from_data || is_wide_type(volume_->info().type);
    if (from_data && !options.range && !options.field_scale && found.range_low < found.range_high) {
      options.range = {found.range_low, found.range_high};
      options.range_from_data = false;
    }
    if (options.error_rule && text_of(*options.error_rule) == earlier_.error_rule && found.max_error >= 0) {
      options.max_error = found.max_error;
      options.error_rule.reset();
      reason_of_bound_ = earlier_.reason_of_bound;
    }
    return options;
  }

  bool inputs_are_the_same() const {
    return std::ranges::equal(earlier_.inputs, record_.inputs,
                              [](const auto& was, const auto& now) { return change_of(was, now).empty(); });
  }

  void settle(const EncodeOptions& options) {
    const PlainBound plain = with_plain_bound(options, *volume_, plan_.budget.threads, run_.searching);
    if (!plain.reason.empty()) reason_of_bound_ = plain.reason;
    range_was_read_ = takes_range_from_data(plain.options, *volume_);
    header_ = {resolve(plain.options, *volume_), kept_fields(plain.options, volume_->info())};
    record_.settings = settings_of(parameters(), run_.source);
    record_.header = serialize_header(header_);
    if (options_.error_rule) {
      record_.error_rule = text_of(*options_.error_rule);
      record_.reason_of_bound = reason_of_bound_;
    }
  }

  void require_same_run(const PartFolder& folder) const {
    const Sentence difference = difference_of(earlier_, record_);
    if (difference.text.empty()) return;
    Sentence refusal{"{}: {}: cannot continue: " + difference.text + "; {}", {resume, run_.output}};
    refusal.terms.insert(refusal.terms.end(), difference.terms.begin(), difference.terms.end());
    refusal.terms.push_back(advice(folder));
    throw UsageError(refusal);
  }

  bool is_finished() const {
    const auto output = status_of(run_.output);
    return output && earlier_.result_inode == output->st_ino &&
           earlier_.result_size == static_cast<std::uint64_t>(output->st_size);
  }

  EncodeResult finished_result() const {
    TagSummary summary = summary_of(run_.output);
    EncodeResult result;
    result.header = std::move(summary.header);
    result.index = std::move(summary.index);
    result.bytes_in = input_bytes();
    result.lossy_source = lossy_source();
    result.file_bytes = summary.sizes.file;
    result.temporary = run_.output;
    result.memory = plan_.memory;
    return result;
  }

  std::string lossy_source() const { return text_of_key(volume_->info().nrrd_fields, lossy_source_key); }

  std::uint64_t input_bytes() const {
    std::uint64_t sum = 0;
    for (const FileIdentity& file : record_.inputs) sum += file.size;
    return sum;
  }

  // Adds a part to the index, returns the size of its blocks, and continues the checksum.
  std::uint64_t survey(const PartsOfRun& parts, std::int64_t part, std::uint64_t& checksum,
                       TagIndex& index) const {
    const PartReader reader(parts.path(part), parts.id(part), parameters());
    for (const PartEntry& entry : reader.table()) {
      checksum = chained_checksum(entry.own_checksum, checksum);
      index.add(entry.activity_bytes, entry.value_bytes, entry.statistics);
    }
    return reader.blocks_size();
  }

  void tell_of_parts(const PartFolder& folder) const {
    const PartsOfRun parts(folder.path(), record_bytes_);
    std::int64_t there = 0;
    for (std::int64_t part = 0; part < parts.count(); ++part)
      there += status_of(parts.path(part)).has_value();
    run_.goes_on(there, parts.count());
  }

  // After this, the run is complete if `file` has its name.
  void record_result(const PartFolder& folder, const OutputFile& file) {
    const auto status = status_of(file.temporary());
    if (!status) throw WorldError(file.temporary() + ": has been removed by another process");
    record_.result_inode = status->st_ino;
    record_.result_size = static_cast<std::uint64_t>(status->st_size);
    write_file(folder.record(), serialize_record(record_));
  }

  EncodeResult assemble(FileOfParts& output) {
    const PartFolder& folder = *output.folder;
    EncodeResult result;
    result.header = header_;
    result.bytes_in = input_bytes();
    const PartsOfRun parts(folder.path(), record_bytes_);
    const std::int64_t kept =
        slices_kept_for_parts(*volume_, parts, plan_, of_this_rank(ranks_, run_.resources));
    result.memory = plan_.memory + static_cast<std::uint64_t>(kept) * volume_->slice_bytes();
    // For all parts, including those of earlier runs.
    result.warnings = all_warnings(volume_->facts());
    result.lossy_source = lossy_source();
    result.reason_of_bound = reason_of_bound_;
    result.times_read = times_read(parameters(), plan_, parts.rows()) + range_was_read_;
    PlaceOrder order{folder.path(), record_bytes_, "", run_.output, {}};
    std::uint64_t position = record_.header.size(), checksum = parts.header_checksum();
    for (std::int64_t part = 0; part < parts.count(); ++part) {
      order.places.push_back({position, checksum});
      position += survey(parts, part, checksum, result.index);
    }
    // The file is created in the folder, so that after a crash it is removed together with the incomplete
    // parts.
    const OutputFileOptions beginning = {
        .like = attributes_of(volume_->files().back()), .others_write = true, .temporaries = folder.path()};
    output.file = std::make_unique<OutputFile>(run_.output, run_.overwrite, beginning);
    OutputFile& file = *output.file;
    file.write(record_.header);
    order.file = file.temporary();
    send_order(ranks_, order);
    place_parts(ranks_, order);
    EnvelopeBlocks envelope(checksum, [&](const Bytes& block) {
      file.write_at(position, block);
      position += block.size();
    });
    const KeepingFiles keeping = keep_source_files(
        *volume_, parameters(), run_.keep_files && !options_.strip,
        [&](SourceFiles& source, bool exact) { share_contents(ranks_, source, exact, run_.resources); },
        [&](std::span<const std::byte> bytes) { envelope.write(bytes); });
    result.why_not_restorable = keeping.why_not_restorable;
    result.times_read += keeping.times_read;
    envelope.finish();
    files_.require();
    warn_of_touched(run_, files_, result);
    const Bytes end = file_end(parameters(), result.index, position, checksum, parts.header_checksum());
    file.write_at(position, end);
    file.sync();
    result.file_bytes = position + end.size();
    result.temporary = file.temporary();
    if (run_.resume) record_result(folder, file);
    return result;
  }

  Ranks& ranks_;
  const EncodeRun& run_;
  std::unique_ptr<VolumeSource> volume_;
  UnchangedFiles files_;  // parts and the envelope must be made of the same files
  EncodePlan plan_;
  TagHeader header_;
  RunRecord record_, earlier_;
  Bytes record_bytes_;
  bool range_was_read_ = false;
  EncodeOptions options_;  // for samples
  std::string reason_of_bound_;
};

}  // namespace

FinishedEncode encode_in_parts(Ranks& ranks, const EncodeRun& run) { return RunInParts(ranks, run).finish(); }

}  // namespace tagrid
