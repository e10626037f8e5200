#include "tools/catalogue/query.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "io/errors/errors.h"
#include "io/text/text.h"
#include "tools/catalogue/database.h"
#include "tools/options/numbers.h"

namespace tagrid {
namespace {

enum class Kind { text, date, number, size };

struct Column {
  std::string_view key, sql;
  Kind kind;
  std::string_view other = "";  ///< a second text that may be meant
};

// Times are compared as dates of UTC.
constexpr std::array columns = {
    Column{"name", "name", Kind::text},
    Column{"status", "status", Kind::text},
    Column{"original", "CASE WHEN state = 'removed' THEN 'removed' ELSE 'kept' END", Kind::text},
    Column{"input", "input", Kind::text},
    Column{"patient", "patient", Kind::text, "patient_id"},
    Column{"patient_id", "patient_id", Kind::text},
    Column{"study", "study", Kind::text, "study_description"},
    Column{"study_date", "study_date", Kind::date},
    Column{"series", "series", Kind::text},
    Column{"modality", "modality", Kind::text},
    Column{"type", "type", Kind::text},
    Column{"bound", "bound", Kind::number},
    Column{"voxels", "voxels", Kind::size},
    Column{"size", "bytes", Kind::size},
    Column{"ratio", "CAST(raw_bytes AS REAL) / bytes", Kind::number},
    Column{"recorded", "coalesce(strftime('%Y-%m-%d', finished, 'unixepoch'), '')", Kind::date},
    Column{"checked", "coalesce(strftime('%Y-%m-%d', check_time, 'unixepoch'), '')", Kind::date},
    Column{"check", "coalesce(check_result, 'never')", Kind::text},
};

const Column* column_of(std::string_view key) {
  const auto found = std::ranges::find(columns, key, &Column::key);
  return found == columns.end() ? nullptr : &*found;
}

bool is_ordering(std::string_view comparison) { return comparison[0] == '<' || comparison[0] == '>'; }

/// A text in which % and _ have no meaning, and * and ? stand for any characters and for one.
std::string like_pattern(std::string_view text, bool has_wildcards) {
  std::string pattern;
  for (const char c : text) {
    if (has_wildcards && (c == '*' || c == '?')) {
      pattern += c == '*' ? '%' : '_';
      continue;
    }
    if (c == '%' || c == '_' || c == '\\') pattern += '\\';
    pattern += c;
  }
  return pattern;
}

/// A number in SQL, which SQLite reads as it is written here.
std::string number_in_sql(const Condition& condition, Kind kind) {
  if (kind == Kind::size) {
    if (const auto bytes = byte_count(condition.value)) return std::to_string(*bytes);
  } else if (const auto number = finite_number(condition.value)) {
    return fmt::format("{:.17g}", *number);
  }
  throw UsageError("{}{}{}: must be a number{}", condition.key, condition.comparison, condition.value,
                   kind == Kind::size ? ", such as 500000 or 10M" : "");
}

SqlCondition compared_text(const std::string& sql, const Condition& condition) {
  const auto& [key, comparison, value] = condition;
  // What is unknown equals nothing, not even *, and differs from everything.
  const std::string text = fmt::format("coalesce({}, '')", sql);
  const std::string is_known = fmt::format("{} <> '' AND ", text),
                    differs = fmt::format("{0} = '' OR ", text);
  const bool is_part = comparison.ends_with('~');
  if (is_part || comparison == "=" || comparison == "!=") {
    const std::string wanted = lower_case_of_unicode(value);
    const std::string pattern =
        is_part ? "%" + like_pattern(wanted, false) + "%" : like_pattern(wanted, true);
    // LIKE itself knows the letters A to Z.
    const bool has_others = std::ranges::any_of(wanted, [](char c) { return (c & 0x80) != 0; });
    const std::string compared = has_others ? fmt::format("{}({})", lower_case_in_sql, text) : text;
    return comparison[0] == '!'
               ? SqlCondition{fmt::format("({}{} NOT LIKE ? ESCAPE '\\')", differs, compared), {pattern}}
               : SqlCondition{fmt::format("({}{} LIKE ? ESCAPE '\\')", is_known, compared), {pattern}};
  }
  return {fmt::format("({0} <> '' AND {0} {1} ? COLLATE NOCASE)", text, comparison), {value}};
}

/// Either of two texts is meant; neither, if the condition is that they differ.
SqlCondition compared_texts(const std::string& sql, const std::string& other, const Condition& condition) {
  SqlCondition both = compared_text(sql, condition), second = compared_text(other, condition);
  both.text =
      fmt::format("({} {} {})", both.text, condition.comparison[0] == '!' ? "AND" : "OR", second.text);
  both.values.insert(both.values.end(), second.values.begin(), second.values.end());
  return both;
}

/// "20200131" for 2020-01-31 or 20200131, "202001" for a month, "2020" for a year; "" for anything else.
std::string digits_of_date(std::string_view text) {
  const bool has_dashes = text.find('-') != text.npos;
  if (has_dashes &&
      (text.size() < 7 || text[4] != '-' || (text.size() != 7 && (text.size() != 10 || text[7] != '-'))))
    return "";
  std::string digits;
  for (std::size_t i = 0; i < text.size(); ++i)
    if (!has_dashes || (i != 4 && i != 7)) digits += text[i];
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  if ((digits.size() != 4 && digits.size() != 6 && digits.size() != 8) ||
      !std::ranges::all_of(digits, is_digit))
    return "";
  if (digits.size() > 4 && (digits.substr(4, 2) < "01" || digits.substr(4, 2) > "12")) return "";
  if (digits.size() > 6 && (digits.substr(6) < "01" || digits.substr(6) > "31")) return "";
  return digits;
}

/// A date may be cut short: 2020 is all of that year.
SqlCondition compared_date(const std::string& sql, const Condition& condition) {
  const auto& [key, comparison, value] = condition;
  if (comparison == "~" || comparison == "!~") return compared_text(sql, condition);
  const std::string date = digits_of_date(value);
  if (date.empty())
    throw UsageError("{}{}{}: must be a date, such as 2020-01-31, 2020-01 or 2020", key, comparison, value);
  return {fmt::format("({0} <> '' AND substr(replace({0}, '-', ''), 1, {1}) {2} ?)", sql, date.size(),
                      comparison),
          {date}};
}

/// The text of a key-value pair.
SqlCondition compared_pair(const Condition& condition) {
  const std::string pair = "json_extract(facts, ?)";
  const std::string path = "$.pairs.\"" + condition.key + "\"";
  if (is_ordering(condition.comparison))
    if (finite_number(condition.value))
      return {fmt::format("CAST({} AS REAL) {} {}", pair, condition.comparison,
                          number_in_sql(condition, Kind::number)),
              {path}};
  SqlCondition compared = compared_text(pair, condition);
  const auto uses = std::ranges::count(compared.text, '?') - 1;
  for (std::ptrdiff_t i = 0; i < uses; ++i) compared.values.insert(compared.values.begin(), path);
  return compared;
}

}  // namespace

std::optional<Condition> condition_in(std::string_view text) {
  const std::size_t at = text.find_first_of("=!~<>");
  if (at == 0 || at == text.npos) return std::nullopt;
  std::size_t length = 1;
  if (text[at] == '!') {
    if (at + 1 == text.size() || (text[at + 1] != '=' && text[at + 1] != '~')) return std::nullopt;
    length = 2;
  } else if (is_ordering(text.substr(at)) && at + 1 < text.size() && text[at + 1] == '=') {
    length = 2;
  }
  return Condition{std::string(text.substr(0, at)), std::string(text.substr(at, length)),
                   std::string(text.substr(at + length))};
}

SqlCondition in_sql(const Condition& condition) {
  const Column* column = column_of(condition.key);
  if (column == nullptr) return compared_pair(condition);
  const std::string sql(column->sql);
  switch (column->kind) {
    case Kind::text:
      return column->other.empty() ? compared_text(sql, condition)
                                   : compared_texts(sql, std::string(column->other), condition);
    case Kind::date:
      return compared_date(sql, condition);
    case Kind::number:
    case Kind::size:
      break;
  }
  if (condition.comparison.ends_with('~'))
    throw UsageError("{}: is a number, which {} cannot compare; use = or <", condition.key,
                     condition.comparison);
  return {fmt::format("{} {} {}", sql, condition.comparison, number_in_sql(condition, column->kind)), {}};
}

bool is_column(std::string_view key) { return column_of(key) != nullptr; }

std::vector<std::string> column_keys() {
  std::vector<std::string> keys;
  for (const Column& column : columns) keys.emplace_back(column.key);
  return keys;
}

}  // namespace tagrid
