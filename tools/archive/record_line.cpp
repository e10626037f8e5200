#include "tools/archive/record_line.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <system_error>

#include "io/errors/errors.h"
#include "io/system/files.h"
#include "io/text/paths.h"
#include "io/text/text.h"
#include "tools/report/failure.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr std::size_t longest_record = std::size_t{1} << 24;

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

/// Nothing if the record describes no output. Throws nlohmann::json::exception if it is not a valid record.
std::optional<KnownOutput> known_output(const ordered_json& record, const std::string& folder) {
  const auto status = record.at("status").get<std::string>();
  const archive::Record state = record_named(status);
  // failed, exists, skipped, kept: these say nothing about the output
  if (status != name_of(state)) return std::nullopt;
  KnownOutput known;
  known.state = state;
  known.input = path_in_records(name_in(record, "input"), folder);
  known.options = record.at("options").get<OptionTexts>();
  for (auto& [name, value] : known.options) value = name_of_text(value);
  for (const auto& file : record.at("input_files"))
    known.input_files.push_back({path_in_records(name_in(file, "path"), folder),
                                 file.at("bytes").get<std::uint64_t>(),
                                 file.at("modified_ns").get<std::int64_t>()});
  known.headerless = record.at("headerless").get<bool>();
  known.bytes_out = record.at("bytes_out").get<std::uint64_t>();
  known.input_checksum = record.at("input_xxh3").get<std::string>();
  known.output_checksum = record.at("output_xxh3").get<std::string>();
  return known;
}

}  // namespace

std::string canonical_folder(const std::string& folder) {
  const std::string path = text_of(real_path_if_known(path_of(folder)));
  return path.size() > 1 && path.ends_with('/') ? path.substr(0, path.size() - 1) : path;
}

std::string name_in_records(const std::string& path, const std::string& base) {
  if (base.empty()) return path;
  const std::string name = text_of(relative_path(path_of(path), path_of(base)));
  return name.empty() ? path : name;
}

std::string path_in_records(const std::string& name, const std::string& base) {
  if (name.empty() || is_absolute(path_of(name)) || name.starts_with(keyed_mark)) return name;
  std::string path = text_of(normal_path(path_of(base) / path_of(name)));
  if (path.size() > 1 && path.ends_with('/')) path.pop_back();  // "." and ".." are directories
  return path;
}

const char* name_of(archive::Record state) {
  switch (state) {
    case archive::Record::damaged:
      return "damaged";
    case archive::Record::removed:
      return "removed";
    default:
      return "ok";
  }
}

archive::Record record_named(std::string_view status) {
  return status == "removed"   ? archive::Record::removed
         : status == "damaged" ? archive::Record::damaged
                               : archive::Record::ok;
}

std::string RecordLine::failure() const {
  if (status != "failed") return "";
  return error.empty() ? "the reason is not recorded" : error;
}

double seconds_since_1970() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

RecordLine parse_record_line(std::string_view line, const std::string& folder) {
  const ordered_json json = ordered_json::parse(line, nullptr, false);
  RecordLine record{name_in(json, "output"), time_of(json), json.at("status").get<std::string>(), {}, {}};
  record.known = known_output(json, folder);
  if (record.known) {
    record.known->time = record.time;
    record.known->record = line;
  }
  if (const auto error = json.find("error"); error != json.end() && error->is_string())
    record.error = error->get<std::string>();
  // With any other status, nothing was to be encoded, or nothing was tried. Nothing was tried
  // either if the command was refused, or if another run held a file.
  const ordered_json code = json.value("code", ordered_json());
  record.is_attempt = record.status == "skipped" || record.status == "ok" ||
                      (record.status == "failed" && code != exit_usage && code != exit_resumable);
  return record;
}

bool replaces(archive::Record record, const RecordTime& time, archive::Record newest,
              const RecordTime& time_of_newest) {
  const bool is_removal = record == archive::Record::removed;
  if (time.sequence == time_of_newest.sequence && is_removal != (newest == archive::Record::removed) &&
      time.sequence > 0)
    return is_removal;
  return time >= time_of_newest;
}

NewLines::NewLines(const std::string& path, LinesRead& read, bool with_rest)
    : read_(read), with_rest_(with_rest) {
  const auto status = status_of(path);
  // Opening a pipe would block, and a pipe has no lines of an earlier run.
  if (status && !status->is_file())
    throw UsageError(path +
                     ": has the name of a file of records and is not a regular file; move it elsewhere");
  if (status && status->size == read_.bytes) return;
  if (status && status->size < read_.bytes) read_ = {};  // another file
  file_.emplace(path);
  file_->skip(read_.bytes);
}

bool NewLines::next(std::string& line) {
  line.clear();
  if (!file_) return false;
  // A line that is too long for a record is not a record. It is read in pieces, to find where it ends.
  std::uint64_t before = 0;
  for (; !file_->read_line(line, longest_record); line.clear()) before += line.size();
  if (!line.ends_with('\n') && !(with_rest_ && !line.empty())) return false;
  read_ = {read_.bytes + before + line.size(), read_.lines + 1};
  if (before > 0) line.clear();
  return true;
}

}  // namespace tagrid
