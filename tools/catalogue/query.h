// What is asked of a catalogue: conditions on volumes, as people write them.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tagrid {

/// A condition: "study_date>=2020-01-01".
struct Condition {
  std::string key;
  std::string comparison;  ///< = != ~ !~ < <= > >=
  std::string value;
};

/// Reads a condition; nothing if a text is none, as the name of an output.
std::optional<Condition> condition_in(std::string_view text);

/// Volumes for which all conditions hold and, if there are names, which have one of them.
struct Query {
  std::vector<Condition> conditions = {};
  std::vector<std::string> names = {};
  std::vector<std::string> patterns = {};  ///< of names, with * and ?
  bool wants_json = false;                 ///< Entries get their facts.
};

/// A condition in SQL, and the texts for its `?`.
struct SqlCondition {
  std::string text;
  std::vector<std::string> values;
};

/// `key` names a column of the index, or a key-value pair of files. Throws UsageError if the value is none of its kind.
SqlCondition in_sql(const Condition& condition);

/// True if the index has a column for this key; all others are key-value pairs.
bool is_column(std::string_view key);
/// The keys of all columns, for messages.
std::vector<std::string> column_keys();

}  // namespace tagrid
