#include "tools/archive/records.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <iterator>
#include <memory>
#include <set>
#include <span>
#include <system_error>
#include <vector>

#include "io/bytes/checksum.h"
#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/file_bytes.h"
#include "io/formats/table/open_volume.h"
#include "io/parity/layout.h"
#include "io/system/files.h"
#include "io/text/paths.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

/// True if files of the volume whose original was removed are there again. `input` exists.
bool is_there_again(const KnownOutput& known, const std::string& input, const RunOptions& run) {
  if (!is_folder(input)) return true;
  for (const InputFile& file : known.input_files)
    if (status_of_name(file.path)) return true;
  try {
    open_volume(input, encoding_of(known.options, run).source);
  } catch (const BrokenInput&) {
    return false;  // no slices
  } catch (const UsageError&) {
    return !known.options.contains("series");  // other series than this one
  }
  return true;
}

archive::Output output_at(const std::string& path, const KnownOutput* known) {
  using archive::Output;
  if (!status_of_name(path)) return Output::absent;
  if (!is_regular_output(path)) return Output::irregular;
  try {
    return known != nullptr && has_written_size(*known, path) ? Output::whole : Output::other;
  } catch (const WorldError&) {
    return Output::other;  // it cannot be opened: whoever needs its content says so
  }
}

}  // namespace

void require_file_or_folder(const std::string& path) {
  const auto status = status_of(path);
  if (!status) throw world_error("cannot open", path, ENOENT);
  if (!status->is_file() && !status->is_folder())
    throw UsageError(path + ": is neither a file nor a directory");
}

std::vector<InputFile> look_at(const std::vector<std::string>& files) {
  std::vector<InputFile> result;
  for (const std::string& file : files) {
    const auto status = status_of(file);
    if (!status) throw world_error("cannot open", file, ENOENT);
    if (!status->is_file()) throw UsageError(file + ": is not a file");
    result.push_back({file, status->size, status->modified.in_nanoseconds()});
  }
  return result;
}

std::string base_of_records(const std::string& folder, const ManifestLine& line) {
  if (!line.is_relative) return "";
  std::string base = canonical_folder(folder);
  const auto steps = [](const fs::path& path) { return std::distance(path.begin(), path.end()) - 1; };
  const fs::path name = relative_path(path_of(line.input), path_of(base));
  return name.empty() || std::ranges::count(name, "..") >= steps(path_of(base)) ? "" : base;
}

ordered_json json_of(const std::vector<InputFile>& files, const std::string& base) {
  ordered_json json = ordered_json::array();
  for (const InputFile& file : files)
    json.push_back({{"path", text_of_name(name_in_records(file.path, base))},
                    {"bytes", file.bytes},
                    {"modified_ns", file.modified}});
  return json;
}

std::string other_volume(const KnownOutput& known, const std::vector<InputFile>& files) {
  std::set<std::string_view> encoded;
  for (const InputFile& file : known.input_files) encoded.insert(file.path);
  const auto was_encoded = [&](const InputFile& file) { return encoded.contains(file.path); };
  if (files.empty() || encoded.empty() || std::ranges::any_of(files, was_encoded)) return "";
  return fmt::format("{} instead of {}", files.front().path, known.input_files.front().path);
}

bool is_file_of_size(const std::string& path, std::uint64_t bytes) {
  const auto status = status_of(path);
  return status && status->is_file() && status->size == bytes;
}

void add_output(const KnownOutput& known, ordered_json& record) {
  const ordered_json earlier = ordered_json::parse(known.record);
  for (const char* key : output_keys)
    if (const auto found = earlier.find(key); found != earlier.end()) record[key] = *found;
  if (const auto subject = earlier.find(subject_key); subject != earlier.end())
    record[subject_key] = *subject;
}

void skip(const KnownOutput& known, ordered_json& record) {
  add_output(known, record);
  record["status"] = "skipped";
}

KnownOutputs::KnownOutputs(const std::string& folder, KeyFile* keys)
    : keys_(keys), given_(folder), folder_(canonical_folder(folder)) {
  read_more();
}

void KnownOutputs::require_these_keys() const {
  if (keys_ == nullptr && sealed_ > 0)
    throw UsageError("{}: its records name originals by keys; give --keys FILE, the key file of this archive",
                     given_);
  if (keys_ != nullptr && plain_ > 0)
    throw UsageError("{}: has records with names of originals; with --keys, give a directory without these",
                     given_);
  if (keys_ != nullptr && !foreign_.empty())
    throw UsageError("{}: is not the key file of {}, or not its only one: {} is of another key",
                     keys_->path(), given_, foreign_);
}

void KnownOutputs::read_more() {
  std::vector<FolderEntry> entries;
  if (!tagrid::files().list(given_, entries)) throw world_error("cannot read", given_, errno);
  for (const FolderEntry& entry : entries) {
    if (!entry.name.ends_with(".jsonl")) continue;
    if (entry.name.starts_with("results")) read(path_in(given_, entry.name));
    if (entry.name.starts_with(events_name)) read_checks(path_in(given_, entry.name));
  }
}

void KnownOutputs::read(const std::string& path) {
  NewLines lines(path, files_[path]);
  const std::size_t first = unreadable_.size();
  for (std::string line; lines.next(line);) {
    try {
      const bool is_keyed = is_sealed(line);
      if (is_keyed) {
        ++sealed_;
        if (keys_ != nullptr) {
          if (foreign_.empty() && !keys_->has_sealed(line))
            foreign_ = fmt::format("{}: line {}", path, files_[path].lines);
          auto opened = keys_->opened(line);
          // It may say anything of its output, as a line that cannot be read.
          if (!opened) {
            unreadable_.push_back(fmt::format("{}: line {} names a key that {} does not have", path,
                                              files_[path].lines, keys_->path()));
            continue;
          }
          line = std::move(*opened);
        }
      }
      RecordLine record = parse_record_line(line, folder_);
      if (!is_keyed) ++plain_;
      // Only what rests on a comparison with the volume shows that a line before it does not matter: a refusal
      // that is recorded must not end the doubt that it follows from.
      if (first < unreadable_.size() && (record.status == "ok" || record.status == "removed"))
        older_[record.output][first] = unreadable_.size();
      note(std::move(record));
    } catch (const nlohmann::json::exception&) {
      unreadable_.push_back(fmt::format("{}: line {} is not a record", path, files_[path].lines));
    }
  }
}

void KnownOutputs::read_checks(const std::string& path) {
  const double now = seconds_since_1970();
  // Unlike the loss of a record, that of a check hides no removal; `archive` commands tell of it.
  try {
    NewLines lines(path, events_[path]);
    for (std::string line; lines.next(line);) {
      try {
        auto check = parse_check(line);
        // A clock may have been wrong: what was checked in the future was not.
        if (!check || check->finished > now) continue;
        CheckEvent& last = checks_[check->output];
        if (check->finished >= last.finished) last = std::move(*check);
      } catch (const nlohmann::json::exception&) {
      }
    }
  } catch (const Error&) {
  }
}

bool KnownOutputs::was_found_damaged(const std::string& output, const std::string& path) const {
  const KnownOutput* known = find(output);
  const auto check = checks_.find(output);
  if (known == nullptr || check == checks_.end() || check->second.status != "damaged" ||
      check->second.finished < known->time.finished)
    return false;
  const InputFile file = look_at({path}).front();
  return file.bytes == check->second.bytes && file.modified == check->second.modified;
}

void KnownOutputs::note(RecordLine record) {
  std::uint64_t& highest = sequences_[record.output];
  highest = std::max(highest, record.time.sequence);
  if (record.is_attempt) {
    const auto [last, is_first] = last_runs_.try_emplace(record.output);
    if (is_first || record.time >= last->second.time) last->second = {record.time, record.failure()};
  }
  if (!record.known) return;
  const auto newest = outputs_.find(record.output);
  if (newest == outputs_.end())
    outputs_.emplace(record.output, std::move(*record.known));
  else if (replaces(record.known->state, record.time, newest->second.state, newest->second.time))
    newest->second = std::move(*record.known);
}

std::string KnownOutputs::possibly_newer(const std::string& output) const {
  std::size_t next = 0;
  if (const auto found = older_.find(output); found != older_.end())
    for (const auto& [first, end] : found->second)
      if (first == next) next = end;
  return next < unreadable_.size() ? unreadable_[next] : "";
}

std::uint64_t KnownOutputs::next_sequence(const std::string& output) const {
  const auto found = sequences_.find(output);
  return found == sequences_.end() ? 1 : std::min(found->second + 1, last_sequence);
}

ordered_json json_of(const OptionTexts& options) {
  ordered_json json = ordered_json::object();
  for (const auto& [name, value] : options) json[name] = text_of_name(value);
  return json;
}

const KnownOutput* KnownOutputs::find(const std::string& output) const {
  const auto found = outputs_.find(output);
  return found == outputs_.end() ? nullptr : &found->second;
}

std::string KnownOutputs::record_of(const std::string& output) const {
  const KnownOutput* known = find(output);
  return known != nullptr ? known->record : "";
}

std::string KnownOutputs::last_failure(const std::string& output) const {
  const auto last = last_runs_.find(output);
  const KnownOutput* known = find(output);
  if (last == last_runs_.end() || (known != nullptr && last->second.time < known->time)) return "";
  return last->second.failure;
}

void note_records(const KnownOutputs& known, const ManifestLine& line, const std::string& path,
                  archive::Facts& facts) {
  const KnownOutput* newest = known.find(line.output);
  facts.record = newest != nullptr ? newest->state : archive::Record::none;
  facts.same_input = newest != nullptr && newest->input == line.input;
  facts.failed = !known.last_failure(line.output).empty();
  facts.unreadable = !known.possibly_newer(line.output).empty();
  facts.output = output_at(path, newest);
  facts.found_damaged = facts.output == archive::Output::whole && known.was_found_damaged(line.output, path);
}

void note_newer_records(KnownOutputs& known, const ManifestLine& line, const std::string& path,
                        const std::string& before, archive::Facts& facts) {
  known.read_more();
  note_records(known, line, path, facts);
  facts.renewed = known.record_of(line.output) != before;
}

archive::Input input_of(const KnownOutputs& known, const ManifestLine& line, const RunOptions& run) {
  const KnownOutput* newest = known.find(line.output);
  const bool was_removed = newest != nullptr && newest->state == archive::Record::removed;
  const bool is_there = was_removed ? status_of_name(line.input) && is_there_again(*newest, line.input, run)
                                    : status_of(line.input).has_value();
  return is_there ? archive::Input::unseen : archive::Input::gone;
}

BrokenInput missing_copy(const std::string& path) {
  return BrokenInput(path +
                     ": is gone or has another size, and its original was removed; restore it from a copy");
}

std::string checksum_text(std::uint64_t checksum) { return fmt::format("{:016x}", checksum); }

// Outputs as they were written, without parity that was added since.

namespace {

/// The output as it was written: without parity that was added since. Nullptr if there is no such file.
std::shared_ptr<const ByteSource> as_written(const KnownOutput& known, const std::string& path) {
  const auto status = status_of(path);
  if (!status || !status->is_file()) return nullptr;
  auto file = std::make_shared<FileSource>(path);
  if (file->size() == known.bytes_out) return file;
  const auto parity = parity_at_end(*file);
  return parity && parity->file_size == known.bytes_out ? beginning_of(file, known.bytes_out) : nullptr;
}

std::uint64_t checksum_of(const ByteSource& file) {
  RunningChecksum checksum;
  std::vector<std::byte> bytes(std::size_t{1} << 20);
  for (std::uint64_t position = 0; position < file.size();) {
    const auto part = std::span(bytes).first(std::min<std::uint64_t>(bytes.size(), file.size() - position));
    file.read_at(position, part);
    checksum.add(part);
    position += part.size();
  }
  return checksum.value();
}

}  // namespace

bool has_written_size(const KnownOutput& known, const std::string& path) {
  // Whoever replaces a file need not be allowed to read it.
  return is_file_of_size(path, known.bytes_out) || as_written(known, path) != nullptr;
}

bool is_as_written(const KnownOutput& known, const std::string& path) {
  const auto file = as_written(known, path);
  return file && checksum_text(checksum_of(*file)) == known.output_checksum;
}

}  // namespace tagrid
