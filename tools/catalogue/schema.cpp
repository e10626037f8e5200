#include "tools/catalogue/schema.h"

namespace tagrid {
namespace {

/// Of an index: "TAGR". No other database is taken for one.
constexpr std::int64_t application = 1413564242, version = 1;

/// A row has what is there (from `bytes` on), what its newest record says (from `sequence` on), what the last attempt to
/// encode it gave, and what the last check found. Long texts have a table of their own: whoever reads many rows does not
/// pass over them.
constexpr const char* schema = R"(
PRAGMA application_id = 1413564242;
PRAGMA user_version = 1;
CREATE TABLE volumes (
  name TEXT PRIMARY KEY,
  bytes INTEGER, modified INTEGER, as_written INTEGER, problem TEXT,
  patient TEXT, patient_id TEXT, study TEXT, study_description TEXT, study_date TEXT, series TEXT, modality TEXT,
  type TEXT, bound REAL, voxels INTEGER, raw_bytes INTEGER,
  sequence INTEGER, finished REAL, state TEXT, written INTEGER, checksum TEXT, input TEXT,
  tried_sequence INTEGER, tried REAL, failure TEXT,
  checked REAL, check_status TEXT, check_error TEXT, checked_bytes INTEGER, checked_modified INTEGER,
  is_new INTEGER
);
CREATE TABLE details (name TEXT PRIMARY KEY, facts TEXT);
CREATE TABLE sources (name TEXT PRIMARY KEY, bytes INTEGER, lines INTEGER, modified INTEGER, tail INTEGER);
CREATE TABLE unreadable (source TEXT, line INTEGER);
CREATE VIEW entries AS SELECT *, CASE
  WHEN bytes IS NULL AND state IS NOT NULL THEN 'missing'
  WHEN bytes IS NULL THEN 'failed'
  WHEN problem IS NOT NULL THEN 'unreadable'
  WHEN check_status = 'damaged' AND checked_bytes = bytes AND checked_modified = modified THEN 'damaged'
  WHEN state IS NULL THEN 'unrecorded'
  WHEN as_written = 0 THEN 'changed'
  WHEN state = 'damaged' THEN 'damaged'
  ELSE 'ok' END AS status FROM volumes;
)";

std::int64_t number_of(const Database& database, const char* sql) {
  Statement row = database.prepare(sql);
  return row.begin().next() ? row.integer(0) : 0;
}

}  // namespace

Owner owner_of(const Database& database) {
  if (number_of(database, "SELECT count(*) FROM sqlite_master") == 0) return Owner::nobody;
  if (number_of(database, "PRAGMA application_id") != application) return Owner::other;
  return number_of(database, "PRAGMA user_version") == version ? Owner::tagrid : Owner::other_version;
}

void make_tables(const Database& database) { database.execute(schema); }

}  // namespace tagrid
