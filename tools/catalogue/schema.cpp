#include "tools/catalogue/schema.h"

namespace tagrid {
namespace {

/// Of an index: "TAGR". No other database is taken for one.
constexpr std::int64_t application = 1413564242;

/// A row has what is there (from `bytes` on), what its newest record says (from `sequence` on), what the last attempt
/// to encode it gave, and what the last check found. A check counts until the output has another size or a newer
/// record. Long texts have a table of their own: whoever reads many rows does not pass over them.
constexpr const char* schema = R"(
PRAGMA application_id = 1413564242;
CREATE TABLE volumes (
  name TEXT PRIMARY KEY,
  bytes INTEGER, modified INTEGER, as_written INTEGER, problem TEXT,
  patient TEXT, patient_id TEXT, study TEXT, study_description TEXT, study_date TEXT, series TEXT, modality TEXT,
  type TEXT, bound REAL, voxels INTEGER, raw_bytes INTEGER,
  sequence INTEGER, finished REAL, state TEXT, written INTEGER, checksum TEXT, input TEXT,
  tried_sequence INTEGER, tried REAL, failure TEXT,
  checked REAL, check_status TEXT, checked_bytes INTEGER,
  is_new INTEGER
);
CREATE TABLE details (name TEXT PRIMARY KEY, facts TEXT);
CREATE TABLE sources (name TEXT PRIMARY KEY, bytes INTEGER, lines INTEGER, modified INTEGER, tail INTEGER);
CREATE TABLE unreadable (source TEXT, line INTEGER);
CREATE VIEW checked_volumes AS SELECT *,
  coalesce(checked_bytes = bytes AND (finished IS NULL OR finished <= checked), 0) AS is_of_check FROM volumes
  WHERE bytes IS NOT NULL OR state IS NOT NULL OR tried IS NOT NULL;
CREATE VIEW entries AS SELECT *, CASE WHEN is_of_check THEN checked END AS check_time,
  CASE WHEN is_of_check THEN check_status END AS check_result, CASE
  WHEN bytes IS NULL AND state IS NOT NULL THEN 'missing'
  WHEN bytes IS NULL THEN 'failed'
  WHEN problem IS NOT NULL THEN 'unreadable'
  WHEN is_of_check AND check_status = 'damaged' THEN 'damaged'
  WHEN state IS NULL THEN 'unrecorded'
  WHEN as_written = 0 THEN 'changed'
  WHEN state = 'damaged' AND NOT (is_of_check AND check_status = 'ok') THEN 'damaged'
  ELSE 'ok' END AS status FROM checked_volumes;
)";

std::int64_t number_of(const Database& database, const char* sql) {
  Statement row = database.prepare(sql);
  return row.begin().next() ? row.integer(0) : 0;
}

std::string tables_of(const Database& database) {
  std::string text;
  Statement rows = database.prepare("SELECT sql FROM sqlite_master ORDER BY name");
  while (rows.next()) text += rows.text(0) + "\n";
  return text;
}

}  // namespace

Owner owner_of(const Database& database) {
  if (number_of(database, "SELECT count(*) FROM sqlite_master") == 0) return Owner::nobody;
  if (number_of(database, "PRAGMA application_id") != application) return Owner::other;
  const Database ours("");
  make_tables(ours);
  return tables_of(database) == tables_of(ours) ? Owner::tagrid : Owner::other_version;
}

void make_tables(const Database& database) { database.execute(schema); }

}  // namespace tagrid
