// Conditions on volumes, and which volumes a check takes.
#include "tools/catalogue/query.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "io/errors/errors.h"
#include "tools/archive/events.h"
#include "tools/archive/subject.h"
#include "tools/catalogue/check.h"
#include "tools/catalogue/database.h"

namespace tagrid {
namespace {

using Words = std::vector<std::string>;

Words parts_of(std::string_view text) {
  const auto condition = condition_in(text);
  if (!condition) return {};
  return {condition->key, condition->comparison, condition->value};
}

TEST(CatalogueQuery, AConditionIsAKeyAComparisonAndAValue) {
  EXPECT_EQ(parts_of("patient=Smith^John"), Words({"patient", "=", "Smith^John"}));
  EXPECT_EQ(parts_of("size>=10M"), Words({"size", ">=", "10M"}));
  EXPECT_EQ(parts_of("size>10M"), Words({"size", ">", "10M"}));
  EXPECT_EQ(parts_of("name!~a=b"), Words({"name", "!~", "a=b"}));
  EXPECT_EQ(parts_of("name!=a"), Words({"name", "!=", "a"}));
  EXPECT_EQ(parts_of("name="), Words({"name", "=", ""}));
  EXPECT_EQ(parts_of("2019/knee.tag"), Words());
  EXPECT_EQ(parts_of("=a"), Words());
  EXPECT_EQ(parts_of("a!b"), Words());
  EXPECT_EQ(parts_of(""), Words());
}

/// Whether the condition holds for a row with this value in a column of that name.
bool holds(const std::string& text, const std::string& column, const std::string& value) {
  const Database database("");
  const SqlCondition sql = in_sql(condition_in(text).value());
  Statement row = database.prepare("SELECT 1 FROM (SELECT '" + value + "' AS " + column +
                                   ", '' AS patient_id, '{}' AS facts) WHERE " + sql.text);
  row.begin();
  int at = 0;
  for (const std::string& one : sql.values) row.set(++at, one);
  return row.next();
}

TEST(CatalogueQuery, TextsAreComparedAsPeopleReadThem) {
  EXPECT_TRUE(holds("patient=smith*", "patient", "Smith^John"));
  EXPECT_TRUE(holds("patient=Sm?th*", "patient", "Smith^John"));
  EXPECT_FALSE(holds("patient=Smith", "patient", "Smith^John"));
  EXPECT_FALSE(holds("patient=Smith%", "patient", "Smith^John"));
  EXPECT_TRUE(holds("name~h_t", "name", "path_to"));
  EXPECT_FALSE(holds("name~h_t", "name", "pathato"));
  EXPECT_TRUE(holds("name!~x", "name", "abc"));
  EXPECT_FALSE(holds("modality<D", "modality", ""));  // what is unknown comes before nothing
  EXPECT_TRUE(holds("modality!=CT", "modality", ""));
}

TEST(CatalogueQuery, ADateMayBeAMonthOrAYear) {
  for (const char* text : {"study_date=2020", "study_date<=2020", "study_date>=2020-05", "study_date<202006",
                           "study_date>2020-05-16", "study_date=20200517"})
    EXPECT_TRUE(holds(text, "study_date", "2020-05-17")) << text;
  for (const char* text :
       {"study_date>2020", "study_date<2020-05", "study_date!=2020", "study_date=2020-5-17x"}) {
    if (std::string(text).ends_with('x'))
      EXPECT_THROW(holds(text, "study_date", "2020-05-17"), UsageError);
    else
      EXPECT_FALSE(holds(text, "study_date", "2020-05-17")) << text;
  }
  EXPECT_FALSE(holds("study_date<2030", "study_date", ""));
  EXPECT_EQ(iso_date("20200131"), "2020-01-31");
  EXPECT_EQ(iso_date("2020.01.31"), "2020.01.31");
}

TEST(CatalogueQuery, NumbersAreNumbers) {
  EXPECT_THROW(in_sql({"size", ">", "ten"}), UsageError);
  EXPECT_THROW(in_sql({"bound", "~", "3"}), UsageError);
  EXPECT_THROW(in_sql({"bound", "<", "1; DROP TABLE volumes"}), UsageError);
  EXPECT_EQ(in_sql({"size", "<", "2K"}).text, "bytes < 2048");
}

Words names_of(const std::vector<CatalogueEntry>& entries) {
  Words names;
  for (const CatalogueEntry& entry : entries) names.push_back(entry.name);
  return names;
}

TEST(CatalogueCheck, TheLongestUncheckedComeFirst) {
  std::vector<CatalogueEntry> all(5);
  for (std::size_t i = 0; i < all.size(); ++i) all[i].name = std::string(1, static_cast<char>('a' + i));
  all[0].checked = 900;
  all[1].checked = 100;
  all[3].checked = 500;
  all[4].status = "failed";  // nothing is there
  EXPECT_EQ(names_of(chosen(all, {}, 1000)), Words({"c", "b", "d", "a"}));
  EXPECT_EQ(names_of(chosen(all, {.percent = 21}, 1000)), Words({"c", "b"}));
  EXPECT_EQ(names_of(chosen(all, {.percent = 0.1}, 1000)), Words({"c"}));
  EXPECT_EQ(names_of(chosen(all, {.least_seconds = 600}, 1000)), Words({"c", "b"}));
}

TEST(CatalogueEvents, ACheckComesBackFromItsLine) {
  const CheckEvent event = {"a\nb\xff.tag", 1234.5, "damaged", "brick 3", 77, -5};
  const std::string line = line_of(event);
  EXPECT_EQ(line.find('\n'), line.npos);
  const CheckEvent read = parse_check(line).value();
  EXPECT_EQ(read.output, event.output);
  EXPECT_EQ(read.finished, event.finished);
  EXPECT_EQ(read.status, event.status);
  EXPECT_EQ(read.error, event.error);
  EXPECT_EQ(read.bytes, event.bytes);
  EXPECT_EQ(read.modified, event.modified);
  EXPECT_FALSE(parse_check(R"({"event":"something newer","output":"a.tag"})"));
  for (const char* broken : {"", "{", "[]", "3", R"({"event":"check"})", R"({"event":"check","output":3})"})
    EXPECT_THROW(parse_check(broken), nlohmann::json::exception) << broken;
}

}  // namespace
}  // namespace tagrid
