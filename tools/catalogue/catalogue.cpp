#include "tools/catalogue/catalogue.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cerrno>
#include <utility>

#include "io/errors/errors.h"
#include "io/system/files.h"
#include "io/text/text.h"
#include "tools/catalogue/lines.h"
#include "tools/catalogue/outputs.h"
#include "tools/catalogue/schema.h"
#include "tools/options/command_line.h"

namespace tagrid {

Catalogue::Catalogue(const std::string& folder, int threads, KeyFile* keys)
    : folder_(folder), threads_(threads) {
  while (folder_.size() > 1 && folder_.ends_with('/')) folder_.pop_back();
  const auto status = status_of(folder_);
  if (!status) throw world_error("cannot open", folder_, ENOENT);
  if (!status->is_folder()) throw UsageError(folder_ + ": is not a directory; give that of the outputs");
  if (keys != nullptr) {
    require_outside("--keys", keys->path(), folder_);
    open("");
    note_keys(*keys);
    return;
  }
  const std::string path = path_of(index_name);
  // Whoever gives another directory must not hear that all is well.
  if (!status_of_name(path) && line_files_in(folder_).empty() && !has_outputs(folder_))
    throw UsageError(folder_ +
                     ": is no archive: it has neither records of convert nor .tag files; give the directory "
                     "of the outputs");
  if (const auto name = status_of_name(path); name && name->is_link()) {
    remarks_ = {path + ": is a link; a temporary index takes its place"};
    open("");
    return;
  }
  for (bool is_again : {false, true}) {
    try {
      open(path);
      return;
    } catch (const DatabaseError& error) {
      database_.reset();
      if (error.is_broken() && !is_again && files().unlink(path)) {
        remarks_ = {
            fmt::format("{}: is no index, or a damaged one ({}); it is made again", path, error.what())};
        continue;
      }
      remarks_ = {
          fmt::format("{}: cannot be used ({}); a temporary index takes its place", path, error.what())};
      break;
    }
  }
  open("");
}

std::string Catalogue::path_of(const std::string& name) const { return folder_ + "/" + name; }

void Catalogue::open(const std::string& path) {
  database_.emplace(path);
  // What an index has that cannot be written need not be found again.
  if (path.empty()) copy_index();
  switch (owner_of(*database_)) {
    case Owner::other:
      throw DatabaseError("it is a database of another program", false);
    case Owner::other_version:
      throw DatabaseError("it is of another version", true);
    case Owner::nobody:
      make_tables(*database_);
      break;
    case Owner::tagrid:
      break;
  }
  // What was deleted is gone from the file, too.
  database_->execute(
      "PRAGMA secure_delete = ON; PRAGMA synchronous = NORMAL; PRAGMA trusted_schema = OFF; PRAGMA "
      "journal_mode = DELETE;");
  update();
}

void Catalogue::copy_index() {
  try {
    const Database index(path_of(index_name), false);
    if (owner_of(index) == Owner::tagrid) database_->copy_from(index);
  } catch (const DatabaseError&) {
    database_.emplace("");
  }
}

void Catalogue::update() {
  Transaction changes(*database_);
  note_lines(*database_, folder_, remarks_);
  note_outputs(*database_, folder_, threads_, remarks_);
  database_->execute(
      "DELETE FROM volumes WHERE bytes IS NULL AND state IS NULL AND tried IS NULL AND checked IS NULL;"
      "DELETE FROM details WHERE name NOT IN (SELECT name FROM volumes);");
  changes.commit();
}

void Catalogue::note_keys(KeyFile& keys) {
  Transaction changes(*database_);
  database_->execute("CREATE INDEX IF NOT EXISTS by_input ON volumes (input)");
  // The half of the newest record of an output describes it, and no other: a line that failed may name another volume.
  Statement subject = database_->prepare(
      "UPDATE volumes SET patient = coalesce(?3, patient), patient_id = coalesce(?4, patient_id), "
      "study = coalesce(?5, study), study_description = coalesce(?6, study_description), "
      "study_date = coalesce(?7, study_date), series = coalesce(?8, series), modality = coalesce(?9, "
      "modality) "
      "WHERE name = ?1 AND input = ?2");
  Statement header =
      database_->prepare("SELECT patient, patient_id FROM volumes WHERE name = ? AND input = ?");
  Statement input = database_->prepare("UPDATE volumes SET input = ?3 WHERE name = ?1 AND input = ?2");
  Statement failure = database_->prepare("UPDATE volumes SET failure = ?3 WHERE name = ?1 AND failure = ?2");
  keys.for_each([&](const nlohmann::ordered_json& half) {
    const auto text = [&](const char* key) {
      const auto found = half.find(key);
      return found != half.end() && found->is_string()
                 ? std::optional(name_of_text(found->get_ref<const std::string&>()))
                 : std::nullopt;
    };
    const std::string name = text("output").value_or(""),
                      keyed = std::string(keyed_mark) + text("keyed").value_or("");
    if (header.begin(name, keyed).next())
      for (const auto& [column, key] : {std::pair(0, "patient"), {1, "patient_id"}})
        if (const std::string in_header = header.text(column), in_keys = text(key).value_or("");
            !in_header.empty() && !in_keys.empty() && in_header != in_keys)
          disputed_.insert(name);
    subject.run(name, keyed, text("patient"), text("patient_id"), text("study"), text("study_description"),
                text("study_date"), text("series"), text("modality"));
    input.run(name, keyed, text("input"));
    failure.run(name, keyed, text("error"));
  });
  changes.commit();
  // Whoever asks for a patient must not hear that there is none because this is another key file.
  Statement rest = database_->prepare(
      "SELECT count(*) FILTER (WHERE input LIKE 'keyed:%'), count(*) FROM volumes WHERE input <> ''");
  if (!rest.begin().next() || rest.integer(0) == 0) return;
  if (rest.integer(0) == rest.integer(1))
    throw UsageError("{}: has no names for any volume in {}; it is another key file, or damaged", keys.path(),
                     folder_);
  remarks_.push_back(
      fmt::format("{}: has no names for {} of the {} volumes in {}; nobody finds them by these", keys.path(),
                  rest.integer(0), rest.integer(1), folder_));
}

Query Catalogue::query_of(const std::vector<std::string>& words) const {
  Query query;
  for (const std::string& word : words) {
    if (const auto name = output_named(word)) {
      query.names.push_back(*name);
    } else if (auto condition = condition_in(word)) {
      condition->key = key_meant(condition->key);
      query.conditions.push_back(std::move(*condition));
    } else if (word.find_first_of("*?") != word.npos) {
      query.patterns.push_back(word);
    } else {
      throw UsageError("{}: no volume in {} has this name, and it is not a condition, such as name~knee",
                       word, folder_);
    }
  }
  return query;
}

std::optional<std::string> Catalogue::output_named(const std::string& word) const {
  Statement row = database_->prepare("SELECT 1 FROM volumes WHERE name = ?");
  for (const std::string& name : {word, word + ".tag"})
    if (row.begin(name).next()) return name;
  return std::nullopt;
}

std::string Catalogue::key_meant(const std::string& key) const {
  if (is_column(key)) return key;
  if (key.find('"') == key.npos) {
    Statement row = database_->prepare("SELECT 1 FROM details WHERE json_type(facts, ?) IS NOT NULL LIMIT 1");
    for (const std::string& pair : {key, "dicom_" + key})
      if (row.begin("$.pairs.\"" + pair + "\"").next()) return pair;
  }
  const std::vector<std::string> keys = column_keys();
  const auto meant = nearest(key, keys);
  throw UsageError(
      "{}: no volume has this key{}; keys are {}, and those of key-value pairs, such as "
      "dicom_BodyPartExamined",
      key, meant ? fmt::format(" (did you mean {}?)", *meant) : "", fmt::join(keys, ", "));
}

Statement Catalogue::selected(const Query& query) const {
  std::string where;
  std::vector<std::string> values;
  bool needs_details = query.wants_json;
  for (const Condition& condition : query.conditions) {
    SqlCondition sql = in_sql(condition);
    where += fmt::format(" AND ({})", sql.text);
    values.insert(values.end(), sql.values.begin(), sql.values.end());
    needs_details = needs_details || !is_column(condition.key);
  }
  std::string of_names;
  if (!query.names.empty()) {
    database_->execute("DROP TABLE IF EXISTS temp.wanted; CREATE TEMP TABLE wanted (name TEXT PRIMARY KEY)");
    Statement add = database_->prepare("INSERT OR IGNORE INTO wanted VALUES (?)");
    for (const std::string& name : query.names) add.run(name);
    of_names = "name IN (SELECT name FROM wanted)";
  }
  for (const std::string& pattern : query.patterns) {
    const SqlCondition sql = in_sql({"name", "=", pattern});
    of_names += (of_names.empty() ? "" : " OR ") + sql.text;
    values.insert(values.end(), sql.values.begin(), sql.values.end());
  }
  if (!of_names.empty()) where += " AND (" + of_names + ")";
  Statement rows = database_->prepare(fmt::format(
      "SELECT name, status, state, bytes, modified, problem, failure, patient, patient_id, "
      "study_date, modality, type, "
      "bound, raw_bytes, check_time, check_result, input, finished, written, checksum{} FROM entries{} WHERE "
      "1{} ORDER BY name",
      query.wants_json ? ", facts" : "", needs_details ? " LEFT JOIN details USING (name)" : "", where));
  rows.begin();
  int at = 0;
  for (const std::string& value : values) rows.set(++at, value);
  return rows;
}

CatalogueEntry Catalogue::entry_in(const Statement& row, bool has_json) {
  CatalogueEntry entry;
  entry.name = row.text(0);
  entry.status = row.text(1);
  entry.is_only_copy = row.text(2) == "removed";
  if (!row.is_null(3)) entry.bytes = static_cast<std::uint64_t>(row.integer(3));
  entry.modified = row.integer(4);
  entry.problem = row.is_null(5) && entry.status == "failed" ? row.text(6) : row.text(5);
  entry.patient = row.text(7);
  entry.patient_id = row.text(8);
  entry.study_date = row.text(9);
  entry.modality = row.text(10);
  entry.type = row.text(11);
  entry.bound = row.number_if_any(12);
  entry.raw_bytes = static_cast<std::uint64_t>(row.integer(13));
  entry.checked = row.number_if_any(14);
  entry.check = row.text(15);
  entry.input = row.text(16);
  entry.recorded = row.number_if_any(17);
  entry.written = static_cast<std::uint64_t>(row.integer(18));
  entry.checksum = row.text(19);
  if (has_json) entry.facts = row.text(20);
  return entry;
}

}  // namespace tagrid
