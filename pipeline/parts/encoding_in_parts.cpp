#include "pipeline/parts/encoding_in_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "io/bytes/checksum.h"
#include "io/errors/errors.h"
#include "io/files/file_bytes.h"
#include "io/files/output_file.h"
#include "io/files/temporaries.h"
#include "io/parts/part_folder.h"
#include "io/system/files.h"
#include "io/tag/bricks.h"
#include "pipeline/encode/graph.h"
#include "pipeline/encode/overviews.h"
#include "pipeline/job/resolved_options.h"
#include "pipeline/memory/parity.h"
#include "pipeline/memory/plan.h"
#include "pipeline/parts/part_work.h"
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

std::string given(const std::optional<std::string>& value) { return value.value_or("not given"); }

// All settings that affect the output, as text, so that a resumed run can be compared with the original one.
std::vector<std::pair<std::string, std::string>> settings_of(const CodingParameters& p,
                                                             const SourceDescription& source) {
  std::vector<std::pair<std::string, std::string>> all = {
      {"dims", fmt::format("{},{},{}", p.dims.x, p.dims.y, p.dims.z)},
      {"type", std::string(name_of(p.type))},
      {"endian", source.raw && source.raw->big_endian.value_or(false) ? "big" : "little"},
      {"offset", fmt::format("{}", source.raw ? source.raw->offset : 0)},
      {"vdb-grid", given(source.vdb_grid)},
      {"from", given(source.from)},
      {"series", given(source.series)},
      {"dataset", given(source.dataset)},
  };
  for (auto& words : in_words(p)) all.push_back(std::move(words));
  return all;
}

bool are_the_same(const std::vector<FileIdentity>& were, const std::vector<FileIdentity>& are) {
  return std::ranges::equal(were, are,
                            [](const auto& was, const auto& now) { return change_of(was, now).empty(); });
}

}  // namespace

EncodingInParts::EncodingInParts(Ranks& ranks, const EncodeRun& run, const VolumeSource& source)
    : ranks_(ranks), run_(run) {
  if (source.info().volumes > 1)
    throw UsageError(
        "{}: holds {} volumes, which one process encodes in one run; start it without "
        "MPI and without continuing, or choose one volume with {}",
        source.name(), source.info().volumes, Setting{"series", "its number"});
  for (const std::string& file : source.files()) record_.inputs.push_back(identity_of(file));
  record_.program = run_.program;
  if (run_.options.error_rule) record_.error_rule = text_of_rule(run_.options);
  folder_ = std::make_unique<PartFolder>(run_.output, run_.resume);
  goes_on_ = run_.resume && read_earlier_record();
  if (!goes_on_ && !is_output_there()) check_output(run_.output, run_.overwrite);
}

Made EncodingInParts::take(const EncodeJob& job) {
  record_.settings = settings_of(job.parameters(), run_.source);
  record_.settings.emplace_back(setting::overviews.name, text_of(job.overviews));
  overviews_ = job.overviews;
  if (run_.options.parity)
    record_.settings.emplace_back(setting::parity.name, text_of_share(*run_.options.parity));
  record_.header = serialize_header(job.header);
  if (!record_.error_rule.empty()) record_.reason_of_bound = job.reason_of_bound;
  if (goes_on_) {
    require_same_run();
    // Only the record of the run remains to be removed.
    if (is_finished()) return Made::yes;
    check_output(run_.output, run_.overwrite);
    folder_->remove_unfinished();
  } else if (is_output_there()) {
    return Made::in_doubt;
  } else if (run_.resume) {
    folder_->clear();
  }
  record_bytes_ = serialize_record(record_);
  write_file(folder_->record(), record_bytes_);
  return Made::no;
}

void EncodingInParts::encode(const EncodeJob& job, const VolumeSource& source, EncodeResult& result) {
  const PartOrder order{run_.input,    run_.source,    folder_->path(),
                        record_bytes_, run_.resources, code_after_signal()};
  parts_ = std::make_unique<PartsOfRun>(folder_->path(), record_bytes_);
  send_order(ranks_, order);
  if (goes_on_ && run_.goes_on) tell_of_parts();
  make_parts(ranks_, order, run_.progress);
  const std::int64_t kept =
      slices_kept_for_parts(source, *parts_, job.plan, of_this_rank(ranks_, run_.resources));
  result.memory += static_cast<std::uint64_t>(kept) * source.slice_bytes();
  // For all parts, including those of earlier runs.
  result.times_read += times_read(job.parameters(), job.plan, parts_->rows());
  result.bytes_in = input_bytes();
  place(attributes_of(source.files().back()));
}

void EncodingInParts::look_at(SourceFiles& files, bool exact) {
  share_contents(ranks_, files, exact, run_.resources);
}

void EncodingInParts::finish(EncodeResult& result) {
  if (!end_.file) return describe_finished(result);
  envelope_->finish();
  if (sums_) write_overviews(result.header);
  const Bytes end = file_end(parts_->header().parameters, pages_->index(), end_.position, end_.checksum,
                             parts_->header_checksum());
  end_.file->write_at(end_.position, end);
  result.file_bytes = end_with_parity(*end_.file, end_.position + end.size(), run_.options.parity,
                                      of_this_rank(ranks_, run_.resources));
  end_.file->sync();
  result.index = pages_->index();
  result.temporary = end_.file->temporary();
  if (run_.resume) record_result();
}

void EncodingInParts::commit() {
  if (end_.file) end_.file->commit();
  remove_record(*folder_);
}

void EncodingInParts::write_overviews(const TagHeader& header) {
  Resources resources = of_this_rank(ranks_, run_.resources);
  resources.spool = spool_folder(resources.spool, run_.output);
  Watch unwatched;
  tagrid::write_overviews(header, overviews_, pages_->index().total, std::move(*sums_), resources,
                          run_.output, *this, unwatched);
}

void EncodingInParts::write_member(std::uint32_t kind, std::uint32_t factor, SpoolFile& content) {
  const Member member = {kind, factor, end_.position, content.size()};
  tagrid::write_member(member, content, end_.checksum, end_);
  pages_->add(member);
}

bool EncodingInParts::read_earlier_record() {
  if (!status_of(folder_->record())) return false;
  const Status status = parse_record(content_of(folder_->record()), earlier_);
  if (!status.ok()) throw UsageError("{}: {} {}; {}", resume, folder_->record(), status.what(), advice());
  return true;
}

std::string EncodingInParts::advice() const {
  return fmt::format("remove {} to start again", folder_->path());
}

// What the earlier run found in the same samples need not be searched again.
EarlierFindings EncodingInParts::earlier_findings() const {
  EarlierFindings findings;
  TagHeader header;
  std::uint64_t checksum;
  if (!goes_on_ || !are_the_same(earlier_.inputs, record_.inputs) ||
      !parse_header(earlier_.header, header, checksum).ok())
    return findings;
  const CodingParameters& found = header.parameters;
  if (found.range_low < found.range_high) findings.range = {found.range_low, found.range_high};
  if (!record_.error_rule.empty() && record_.error_rule == earlier_.error_rule && found.max_error >= 0) {
    findings.max_error = found.max_error;
    findings.transform_step = found.transform_step;
    findings.filter = found.filter;
    findings.reason_of_bound = earlier_.reason_of_bound;
  }
  return findings;
}

void EncodingInParts::require_same_run() const {
  const Sentence difference = difference_of(earlier_, record_);
  if (difference.text.empty()) return;
  throw UsageError("{}: {}: cannot continue: {}; {}", resume, run_.output, difference, advice());
}

// Without a record: a run may have been killed after it had given the file its name.
bool EncodingInParts::is_output_there() const {
  return run_.resume && !run_.overwrite && is_regular_output(run_.output) && status_of(run_.output);
}

bool EncodingInParts::is_finished() const {
  const auto output = status_of(run_.output);
  return output && earlier_.result_inode == output->number && earlier_.result_size == output->size;
}

void EncodingInParts::describe_finished(EncodeResult& result) const {
  TagSummary summary = summary_of(run_.output);
  result.index = std::move(summary.index);
  result.bytes_in = input_bytes();
  result.file_bytes = summary.sizes.file;
  result.temporary = run_.output;
}

std::uint64_t EncodingInParts::input_bytes() const {
  std::uint64_t sum = 0;
  for (const FileIdentity& file : record_.inputs) sum += file.size;
  return sum;
}

// Adds a part to the index, whose complete pages are written, and continues the checksum. Returns where the
// blocks of the part belong.
std::vector<PartPlace> EncodingInParts::survey(std::int64_t part) {
  PartReader reader(parts_->path(part), parts_->id(part), parts_->header().parameters);
  std::vector<PartPlace> places;
  for (const PartEntry& entry : reader.table()) {
    if (places.empty() || pages_->is_between_pages()) places.push_back({end_.position, end_.checksum, 0});
    ++places.back().bricks;
    end_.checksum = chained_checksum(entry.own_checksum, end_.checksum);
    end_.position += entry.block_bytes();
    pages_->add(entry.activity_bytes, entry.value_bytes, entry.statistics);
  }
  if (sums_) take_sums(reader, parts_->blocks(part));
  return places;
}

// Puts the sums of a part among those of the volume.
void EncodingInParts::take_sums(PartReader& reader, const Box& blocks) {
  std::int64_t z = blocks.low.z;
  const std::size_t slice = static_cast<std::size_t>(blocks.size().y) * sums_->layout().row_bytes();
  reader.read_sums(slice, [&](std::span<const std::byte> rows) { sums_->write(z++, blocks.low.y, rows); });
}

void EncodingInParts::tell_of_parts() const {
  std::int64_t there = 0;
  for (std::int64_t part = 0; part < parts_->count(); ++part)
    there += status_of(parts_->path(part)).has_value();
  run_.goes_on(there, parts_->count());
}

// All ranks write the parts into the file. After a crash it is removed with the incomplete parts.
void EncodingInParts::place(const std::optional<FileAttributes>& like) {
  PlaceOrder order{folder_->path(), record_bytes_, "", run_.output, {}};
  end_.position = record_.header.size();
  end_.checksum = parts_->header_checksum();
  if (const CodingParameters& p = parts_->header().parameters; parts_->has_sums())
    sums_.emplace(layout_of_sums(p.dims, p.type, block_edge), spool_folder(run_.resources.spool, run_.output),
                  run_.output);
  const OutputFileOptions beginning = {.like = like, .others_write = true, .temporaries = folder_->path()};
  end_.file = std::make_unique<OutputFile>(run_.output, run_.overwrite, beginning);
  end_.file->write(record_.header);
  pages_.emplace(parts_->header().parameters.bricks().count(), end_.checksum, end_);
  for (std::int64_t part = 0; part < parts_->count(); ++part) order.places.push_back(survey(part));
  order.file = end_.file->temporary();
  send_order(ranks_, order);
  place_parts(ranks_, order);
  envelope_.emplace(end_.checksum, end_);
}

// After this, the run is complete if the file has its name.
void EncodingInParts::record_result() {
  const auto status = status_of(end_.file->temporary());
  if (!status) throw WorldError(end_.file->temporary() + ": has been removed by another process");
  record_.result_inode = status->number;
  record_.result_size = status->size;
  write_file(folder_->record(), serialize_record(record_));
}

}  // namespace tagrid
