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
#include "io/text/text.h"
#include "tools/report/failure.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr std::size_t longest_record = std::size_t{1} << 24;
/// A forged record must not make the next one the first. Programs that read JSON as doubles know it exactly.
constexpr std::uint64_t last_sequence = (std::uint64_t{1} << 53) - 1;

std::optional<archive::Record> state_of(const std::string& status) {
  if (status == "ok") return archive::Record::ok;
  if (status == "damaged") return archive::Record::damaged;
  if (status == "removed") return archive::Record::removed;
  return std::nullopt;  // failed, exists, skipped, kept: these say nothing about the output
}

/// Throws nlohmann::json::exception if there is none.
std::string name_in(const ordered_json& object, const char* key) {
  return name_of_text(object.at(key).get<std::string>());
}

/// Throws nlohmann::json::exception if `record` does not say.
RecordTime time_of(const ordered_json& record) {
  RecordTime time{0, record.at("finished").get<double>()};
  // Earlier versions did not count.
  if (const auto sequence = record.find("sequence");
      sequence != record.end() && sequence->is_number_unsigned())
    time.sequence = std::min(sequence->get<std::uint64_t>(), last_sequence);
  return time;
}

/// Whether `record` describes the output instead of `newest`. In one file, the later line is the newer one.
/// Of two simultaneous runs, one that removed an original counts: its output may be the only copy.
bool replaces(const KnownOutput& record, const KnownOutput& newest) {
  const auto is_removal = [](const KnownOutput& known) { return known.state == archive::Record::removed; };
  if (record.time.sequence == newest.time.sequence && is_removal(record) != is_removal(newest) &&
      record.time.sequence > 0)
    return is_removal(record);
  return record.time >= newest.time;
}

std::string canonical_folder(const std::string& folder) {
  std::error_code error;
  const fs::path canonical = fs::weakly_canonical(fs::absolute(folder), error);
  const std::string path = error ? fs::absolute(folder).string() : canonical.string();
  return path.size() > 1 && path.ends_with('/') ? path.substr(0, path.size() - 1) : path;
}

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
    result.push_back({file, status->size,
                      std::int64_t{status->modified.seconds} * 1'000'000'000 + status->modified.nanoseconds});
  }
  return result;
}

std::string base_of_records(const std::string& folder, const ManifestLine& line) {
  if (!line.is_relative) return "";
  std::string base = canonical_folder(folder);
  const auto steps = [](const fs::path& path) { return std::distance(path.begin(), path.end()) - 1; };
  const fs::path name = fs::path(line.input).lexically_relative(base);
  return name.empty() || std::ranges::count(name, "..") >= steps(base) ? "" : base;
}

std::string name_in_records(const std::string& path, const std::string& base) {
  if (base.empty()) return path;
  const std::string name = fs::path(path).lexically_relative(base).string();
  return name.empty() ? path : name;
}

std::string path_in_records(const std::string& name, const std::string& base) {
  if (name.empty() || fs::path(name).is_absolute()) return name;
  std::string path = (fs::path(base) / name).lexically_normal().string();
  if (path.size() > 1 && path.ends_with('/')) path.pop_back();  // "." and ".." are directories
  return path;
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
}

void skip(const KnownOutput& known, ordered_json& record) {
  add_output(known, record);
  record["status"] = "skipped";
}

KnownOutputs::KnownOutputs(const std::string& folder) : given_(folder), folder_(canonical_folder(folder)) {
  read_more();
}

void KnownOutputs::read_more() {
  std::vector<FolderEntry> entries;
  if (!tagrid::files().list(given_, entries)) throw world_error("cannot read", given_, errno);
  for (const FolderEntry& entry : entries)
    if (entry.name.starts_with("results") && entry.name.ends_with(".jsonl"))
      read((fs::path(given_) / entry.name).string());
}

void KnownOutputs::read(const std::string& path) {
  // Opening a pipe would block, and a pipe has no lines of an earlier run.
  if (const auto status = status_of(path); status && !status->is_file())
    throw UsageError(path +
                     ": has the name of a file of records and is not a regular file; move it elsewhere");
  End& end = files_[path];
  const auto status = status_of(path);
  if (status && status->size == end.bytes) return;
  if (status && status->size < end.bytes) end = {};  // another file
  FileBytes file(path);
  file.skip(end.bytes);
  const std::size_t first = unreadable_.size();
  for (std::string line;; line.clear()) {
    // A line that is too long for a record is not a record. It is read in pieces, to find where it ends.
    bool is_too_long = false;
    std::uint64_t bytes = 0;
    for (; !file.read_line(line, longest_record); line.clear()) {
      is_too_long = true;
      bytes += line.size();
    }
    // Half a last line is all that a killed run wrote of a record.
    if (!line.ends_with('\n')) break;
    end = {end.bytes + bytes + line.size(), end.lines + 1};
    const ordered_json record = is_too_long ? ordered_json() : ordered_json::parse(line, nullptr, false);
    try {
      const std::string output = note(record, line);
      // Only what rests on a comparison with the volume shows that a line before it does not matter: a refusal
      // that is recorded must not end the doubt that it follows from.
      const auto said = record.at("status").get<std::string>();
      if (first < unreadable_.size() && (said == "ok" || said == "removed"))
        older_[output][first] = unreadable_.size();
    } catch (const nlohmann::json::exception&) {
      unreadable_.push_back(fmt::format("{}: line {} is not a record", path, end.lines));
    }
  }
}

/// Nothing if the record describes no output. Throws nlohmann::json::exception if it is not a valid record.
std::optional<KnownOutput> KnownOutputs::known_output(const ordered_json& record) const {
  const auto state = state_of(record.at("status").get<std::string>());
  if (!state) return std::nullopt;
  KnownOutput known;
  known.state = *state;
  known.input = path_in_records(name_in(record, "input"), folder_);
  known.options = record.at("options").get<OptionTexts>();
  for (auto& [name, value] : known.options) value = name_of_text(value);
  for (const auto& file : record.at("input_files"))
    known.input_files.push_back({path_in_records(name_in(file, "path"), folder_),
                                 file.at("bytes").get<std::uint64_t>(),
                                 file.at("modified_ns").get<std::int64_t>()});
  known.headerless = record.at("headerless").get<bool>();
  known.bytes_out = record.at("bytes_out").get<std::uint64_t>();
  known.input_checksum = record.at("input_xxh3").get<std::string>();
  known.output_checksum = record.at("output_xxh3").get<std::string>();
  return known;
}

std::string KnownOutputs::note(const ordered_json& record, const std::string& line) {
  std::string output = name_in(record, "output");
  const RecordTime time = time_of(record);
  std::uint64_t& highest = sequences_[output];
  highest = std::max(highest, time.sequence);
  note_failure(record, output, time);
  auto known = known_output(record);
  if (!known) return output;
  known->time = time;
  known->record = line;
  const auto newest = outputs_.find(output);
  if (newest == outputs_.end())
    outputs_.emplace(output, std::move(*known));
  else if (replaces(*known, newest->second))
    newest->second = std::move(*known);
  return output;
}

std::string KnownOutputs::possibly_newer(const std::string& output) const {
  std::size_t next = 0;
  if (const auto found = older_.find(output); found != older_.end())
    for (const auto& [first, end] : found->second)
      if (first == next) next = end;
  return next < unreadable_.size() ? unreadable_[next] : "";
}

void KnownOutputs::note_failure(const ordered_json& record, const std::string& output,
                                const RecordTime& time) {
  // With any other status, nothing was to be encoded, or nothing was tried. Nothing was tried
  // either if the command was refused, or if another run held a file.
  const auto status = record.at("status").get<std::string>();
  const ordered_json code = record.value("code", ordered_json());
  if (status != "failed" && status != "skipped" && status != "ok") return;
  if (status == "failed" && (code == exit_usage || code == exit_resumable)) return;
  const auto [last, is_first] = last_runs_.try_emplace(output);
  if (!is_first && time < last->second.time) return;
  const auto error = record.find("error");
  const bool has_reason = error != record.end() && error->is_string();
  last->second = {time, status != "failed" ? ""
                        : has_reason       ? error->get<std::string>()
                                           : "the reason is not recorded"};
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
