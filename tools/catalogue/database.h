// SQLite, as far as the index of an archive needs it: its errors are exceptions, and its objects are destroyed in order.
#pragma once

#include <concepts>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "io/errors/errors.h"

struct sqlite3;
struct sqlite3_stmt;

namespace tagrid {

/// A file is not a database, is damaged, is held by another process, or cannot be read or written.
class DatabaseError : public WorldError {
 public:
  DatabaseError(const std::string& message, bool is_broken) : WorldError(message), is_broken_(is_broken) {}
  /// True if another file must take its place: it is not a database, a damaged one, or has not the tables that it should
  /// have.
  bool is_broken() const { return is_broken_; }

 private:
  bool is_broken_;
};

/// A compiled statement. Values are numbered in the order of `?` in its text, columns in that of its result, from 0.
class Statement {
 public:
  /// Begins with these values: integers, doubles, texts, and std::nullopt or empty optionals, which are NULL. Call
  /// next() for its rows.
  template <class... Values>
  Statement& begin(const Values&... values) {
    reset();
    int at = 0;
    (bind(++at, values), ...);
    return *this;
  }
  /// Carries out a statement without rows.
  template <class... Values>
  void run(const Values&... values) {
    begin(values...);
    while (next()) {
    }
  }
  /// Sets a value after begin(), which was called without values. `at`: from 1.
  template <class Value>
  void set(int at, const Value& value) {
    bind(at, value);
  }
  /// Moves to the next row, at first to the first one. Returns false after the last one.
  bool next();

  bool is_null(int column) const;
  std::int64_t integer(int column) const;
  double number(int column) const;
  std::string text(int column) const;
  std::optional<double> number_if_any(int column) const {
    return is_null(column) ? std::nullopt : std::optional(number(column));
  }

 private:
  friend class Database;
  struct Deleter {
    void operator()(sqlite3_stmt* statement) const;
  };

  explicit Statement(sqlite3_stmt* statement) : statement_(statement) {}
  void reset();
  void bind(int at, std::nullopt_t);
  void bind(int at, double value);
  void bind(int at, std::integral auto value) { bind_integer(at, static_cast<std::int64_t>(value)); }
  void bind(int at, std::string_view value);
  void bind(int at, const std::string& value) { bind(at, std::string_view(value)); }
  void bind(int at, const char* value) { bind(at, std::string_view(value)); }
  template <class Value>
  void bind(int at, const std::optional<Value>& value) {
    value ? bind(at, *value) : bind(at, std::nullopt);
  }
  void bind_integer(int at, std::int64_t value);
  [[noreturn]] void fail() const;

  std::unique_ptr<sqlite3_stmt, Deleter> statement_;
};

/// A function in SQL, which makes all letters small; SQLite's lower() knows those of English.
inline constexpr const char* lower_case_in_sql = "lower_case_of_unicode";

/// An open database. All its statements must be destroyed before it.
class Database {
 public:
  /// Opens the file, which is created if it does not exist and `writes`. "": a temporary one without a name.
  explicit Database(const std::string& path, bool writes = true);

  Statement prepare(std::string_view sql) const;
  /// Carries out statements that have no values and no rows.
  void execute(const char* sql) const;
  /// Replaces all of it by the content of another one.
  void copy_from(const Database& other);

 private:
  struct Deleter {
    void operator()(sqlite3* database) const;
  };

  std::unique_ptr<sqlite3, Deleter> database_;
};

/// What is written between this and commit() is written as a whole, or, without commit(), not at all.
class Transaction {
 public:
  explicit Transaction(const Database& database) : database_(database) {
    database_.execute("BEGIN IMMEDIATE");
  }
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  void commit();

 private:
  const Database& database_;
  bool is_open_ = true;
};

}  // namespace tagrid
