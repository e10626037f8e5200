#include "tools/catalogue/database.h"

#include <sqlite3.h>

#include "io/text/text.h"

namespace tagrid {
namespace {

constexpr int milliseconds_to_wait = 10'000;  // for another process that writes

DatabaseError error_of(sqlite3* database) {
  const int code = sqlite3_errcode(database);
  return {sqlite3_errmsg(database), code == SQLITE_NOTADB || code == SQLITE_CORRUPT || code == SQLITE_ERROR};
}

void lower_case_of_value(sqlite3_context* context, int, sqlite3_value** values) {
  const auto* text = reinterpret_cast<const char*>(sqlite3_value_text(values[0]));
  if (text == nullptr) return sqlite3_result_null(context);
  const std::string lower =
      lower_case_of_unicode({text, static_cast<std::size_t>(sqlite3_value_bytes(values[0]))});
  sqlite3_result_text64(context, lower.data(), lower.size(), SQLITE_TRANSIENT, SQLITE_UTF8);
}

}  // namespace

void Statement::Deleter::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }

void Statement::fail() const { throw error_of(sqlite3_db_handle(statement_.get())); }

void Statement::reset() {
  sqlite3_reset(statement_.get());  // repeats the error of the last step
  sqlite3_clear_bindings(statement_.get());
}

void Statement::bind(int at, std::nullopt_t) {
  if (sqlite3_bind_null(statement_.get(), at) != SQLITE_OK) fail();
}

void Statement::bind(int at, double value) {
  if (sqlite3_bind_double(statement_.get(), at, value) != SQLITE_OK) fail();
}

void Statement::bind_integer(int at, std::int64_t value) {
  if (sqlite3_bind_int64(statement_.get(), at, value) != SQLITE_OK) fail();
}

void Statement::bind(int at, std::string_view value) {
  if (sqlite3_bind_text64(statement_.get(), at, value.data() != nullptr ? value.data() : "", value.size(),
                          SQLITE_TRANSIENT, SQLITE_UTF8) != SQLITE_OK)
    fail();
}

bool Statement::next() {
  const int result = sqlite3_step(statement_.get());
  if (result != SQLITE_ROW && result != SQLITE_DONE) fail();
  return result == SQLITE_ROW;
}

bool Statement::is_null(int column) const {
  return sqlite3_column_type(statement_.get(), column) == SQLITE_NULL;
}

std::int64_t Statement::integer(int column) const { return sqlite3_column_int64(statement_.get(), column); }

double Statement::number(int column) const { return sqlite3_column_double(statement_.get(), column); }

std::string Statement::text(int column) const {
  const unsigned char* text = sqlite3_column_text(statement_.get(), column);
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column));
  return text != nullptr ? std::string(reinterpret_cast<const char*>(text), size) : std::string();
}

void Database::Deleter::operator()(sqlite3* database) const { sqlite3_close(database); }

Database::Database(const std::string& path, bool writes) {
  sqlite3* database = nullptr;
  const int how = writes ? SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE : SQLITE_OPEN_READONLY;
  const int result = sqlite3_open_v2(path.c_str(), &database, how, nullptr);
  database_.reset(database);
  if (result != SQLITE_OK) throw error_of(database);
  sqlite3_busy_timeout(database, milliseconds_to_wait);
  if (sqlite3_create_function(database, lower_case_in_sql, 1, SQLITE_UTF8 | SQLITE_DETERMINISTIC, nullptr,
                              lower_case_of_value, nullptr, nullptr) != SQLITE_OK)
    throw error_of(database);
}

Statement Database::prepare(std::string_view sql) const {
  sqlite3_stmt* statement = nullptr;
  if (sqlite3_prepare_v2(database_.get(), sql.data(), static_cast<int>(sql.size()), &statement, nullptr) !=
      SQLITE_OK)
    throw error_of(database_.get());
  return Statement(statement);
}

void Database::execute(const char* sql) const {
  if (sqlite3_exec(database_.get(), sql, nullptr, nullptr, nullptr) != SQLITE_OK)
    throw error_of(database_.get());
}

void Database::copy_from(const Database& other) {
  sqlite3_backup* copy = sqlite3_backup_init(database_.get(), "main", other.database_.get(), "main");
  if (copy == nullptr) throw error_of(database_.get());
  sqlite3_backup_step(copy, -1);
  if (sqlite3_backup_finish(copy) != SQLITE_OK) throw error_of(database_.get());
}

Transaction::~Transaction() {
  if (!is_open_) return;
  try {
    database_.execute("ROLLBACK");
  } catch (const DatabaseError&) {
    // It was rolled back already: that is what the failure was.
  }
}

void Transaction::commit() {
  database_.execute("COMMIT");
  is_open_ = false;
}

}  // namespace tagrid
