#include "tools/catalogue/lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <span>

#include "io/bytes/checksum.h"
#include "io/errors/errors.h"
#include "io/files/file_bytes.h"
#include "io/system/files.h"
#include "tools/archive/events.h"
#include "tools/archive/manifest.h"
#include "tools/archive/record_line.h"

namespace tagrid {
namespace {

/// How far such a file was read, and what shows that it has only grown since.
struct KnownLines {
  LinesRead read;
  std::int64_t modified = 0;
  std::int64_t tail = 0;  ///< checksum of the last bytes that were read
};

std::map<std::string, KnownLines> known_lines(const Database& index) {
  std::map<std::string, KnownLines> known;
  Statement rows = index.prepare("SELECT name, bytes, lines, modified, tail FROM sources");
  while (rows.next())
    known[rows.text(0)] = {
        {static_cast<std::uint64_t>(rows.integer(1)), static_cast<std::uint64_t>(rows.integer(2))},
        rows.integer(3),
        rows.integer(4)};
  return known;
}

std::int64_t tail_of(const std::string& path, std::uint64_t end) {
  const FileSource file(path);
  std::array<std::byte, 4096> bytes = {};
  const auto tail =
      std::span(bytes).first(static_cast<std::size_t>(std::min<std::uint64_t>(end, bytes.size())));
  if (file.size() < end) return -1;
  file.read_at(end - tail.size(), tail);
  return static_cast<std::int64_t>(checksum_of({tail}) >> 1);
}

std::int64_t modified_ns(const std::string& path) {
  const auto status = status_of(path);
  return status ? status->modified.in_nanoseconds() : 0;
}

/// True if the lines that were read are still there, as far as times and the last bytes show.
bool all_grew(const std::string& folder, const std::vector<LineFileName>& names,
              const std::map<std::string, KnownLines>& known) {
  for (const auto& [name, lines] : known) {
    if (std::ranges::find(names, name, &LineFileName::name) == names.end()) return false;
    const std::string path = folder + "/" + name;
    const auto status = status_of(path);
    if (!status || status->size < lines.read.bytes) return false;
    const bool may_be_as_before =
        status->modified.in_nanoseconds() == lines.modified || status->size > lines.read.bytes;
    if (!may_be_as_before || tail_of(path, lines.read.bytes) != lines.tail) return false;
  }
  return true;
}

constexpr const char* forget_lines = R"(
DELETE FROM sources;
DELETE FROM unreadable;
UPDATE volumes SET sequence = NULL, finished = NULL, state = NULL, written = NULL, checksum = NULL, input = NULL,
  as_written = NULL,
  tried_sequence = NULL, tried = NULL, failure = NULL,
  checked = NULL, check_status = NULL, checked_bytes = NULL;
)";

class LineNotes {
 public:
  LineNotes(const Database& index, const std::string& folder)
      : folder_(folder),
        base_(canonical_folder(folder)),
        newest_(index.prepare("SELECT sequence, finished, state FROM volumes WHERE name = ?")),
        record_(index.prepare(
            "INSERT INTO volumes (name, sequence, finished, state, written, checksum, input, is_new) "
            "VALUES (?, ?, ?, ?, ?, ?, ?, 1) ON CONFLICT (name) DO UPDATE SET sequence = excluded.sequence, "
            "finished = excluded.finished, state = excluded.state, written = excluded.written, "
            "checksum = excluded.checksum, input = excluded.input, is_new = 1")),
        attempt_(
            index.prepare("INSERT INTO volumes (name, tried_sequence, tried, failure) VALUES (?, ?, ?, ?) "
                          "ON CONFLICT (name) DO UPDATE SET tried_sequence = excluded.tried_sequence, tried "
                          "= excluded.tried, "
                          "failure = excluded.failure WHERE tried IS NULL "
                          "OR (excluded.tried_sequence, excluded.tried) >= (tried_sequence, tried)")),
        check_(index.prepare(
            "INSERT INTO volumes (name, checked, check_status, checked_bytes) VALUES (?1, ?2, ?3, ?4) "
            "ON CONFLICT (name) DO UPDATE SET checked = excluded.checked, "
            "check_status = excluded.check_status, checked_bytes = excluded.checked_bytes "
            "WHERE checked IS NULL OR excluded.checked >= checked OR checked > ?5")),
        unreadable_(index.prepare("INSERT INTO unreadable VALUES (?, ?)")),
        source_(index.prepare("INSERT OR REPLACE INTO sources VALUES (?, ?, ?, ?, ?)")) {}

  void read(const LineFileName& source, KnownLines& known) {
    const std::string path = folder_ + "/" + source.name;
    const std::int64_t modified = modified_ns(path);
    const std::uint64_t before = known.read.bytes;
    NewLines lines(path, known.read);
    for (std::string line; lines.next(line);) {
      try {
        const bool is_known = source.has_events ? note_event(line) : note_record(line);
        if (!is_known) unreadable_.run(source.name, known.read.lines);
      } catch (const nlohmann::json::exception&) {
        unreadable_.run(source.name, known.read.lines);
      }
    }
    if (known.read.bytes != before || known.modified != modified)
      source_.run(source.name, known.read.bytes, known.read.lines, modified, tail_of(path, known.read.bytes));
  }

 private:
  /// False if no output can have the name in the line, which anybody may have changed.
  bool note_record(const std::string& line) {
    const RecordLine record = parse_record_line(line, base_);
    if (!is_possible_output(record.output)) return false;
    const RecordTime& time = record.time;
    if (record.is_attempt) attempt_.run(record.output, time.sequence, time.finished, record.failure());
    if (!record.known) return true;
    const KnownOutput& known = *record.known;
    if (newest_.begin(record.output).next() && !newest_.is_null(2)) {
      const RecordTime newest = {static_cast<std::uint64_t>(newest_.integer(0)), newest_.number(1)};
      if (!replaces(known.state, time, record_named(newest_.text(2)), newest)) return true;
    }
    record_.run(record.output, time.sequence, time.finished, name_of(known.state), known.bytes_out,
                known.output_checksum, known.input);
    return true;
  }

  /// The same.
  bool note_event(const std::string& line) {
    const auto check = parse_check(line);
    if (!check) return true;
    if (!is_possible_output(check->output)) return false;
    check_.run(check->output, check->finished, check->status, check->bytes, now_);
    return true;
  }

  std::string folder_, base_;
  double now_ = seconds_since_1970();
  Statement newest_, record_, attempt_, check_, unreadable_, source_;
};

}  // namespace

void refuse_link(const std::string& path) {
  if (const auto status = status_of_name(path); status && status->is_link())
    throw UsageError(path + ": is a link; put the file in its place");
}

std::vector<LineFileName> line_files_in(const std::string& folder) {
  std::vector<FolderEntry> entries;
  if (!files().list(folder, entries)) throw world_error("cannot read", folder, errno);
  std::vector<LineFileName> names;
  for (const FolderEntry& entry : entries) {
    const bool has_events = entry.name.starts_with(events_name);
    if (entry.name.ends_with(".jsonl") && (has_events || entry.name.starts_with("results")))
      names.push_back({entry.name, has_events});
  }
  std::ranges::sort(names, {}, &LineFileName::name);
  return names;
}

void note_lines(const Database& index, const std::string& folder, std::vector<std::string>& remarks) {
  const std::vector<LineFileName> names = line_files_in(folder);
  std::map<std::string, KnownLines> known = known_lines(index);
  if (!all_grew(folder, names, known)) {
    index.execute(forget_lines);
    known.clear();
  }
  LineNotes notes(index, folder);
  for (const LineFileName& name : names) notes.read(name, known[name.name]);
  if (std::ranges::all_of(names, &LineFileName::has_events))
    remarks.push_back(folder +
                      ": has no records of convert (results.jsonl); only its .tag files say what it has");
  constexpr std::size_t most = 20;
  std::size_t count = 0;
  Statement rows = index.prepare("SELECT source, line FROM unreadable ORDER BY source, line");
  while (rows.next())
    if (++count <= most)
      remarks.push_back(fmt::format("{}/{}: line {} is not a record", folder, rows.text(0), rows.integer(1)));
  if (count > most) remarks.push_back(fmt::format("{} more lines are not records", count - most));
}

}  // namespace tagrid
