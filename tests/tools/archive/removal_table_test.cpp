// The tables of both passes: each row by itself, and laws that hold for all combinations of facts.
#include "tools/archive/removal_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <initializer_list>
#include <set>
#include <span>
#include <string>
#include <vector>

namespace tagrid::archive {
namespace {

/// Facts to which a row applies, in the order of the rows.
struct Case {
  const char* name;
  Facts facts;
};

/// Of a line of which there is such a record.
Facts recorded(Record record, Output output, Facts facts) {
  facts.record = record;
  facts.same_input = true;
  facts.output = output;
  return facts;
}
/// Of a line whose output is what its record says.
Facts known(const Facts& facts) { return recorded(Record::ok, Output::whole, facts); }

const std::vector<Case> encoding_cases = {
    {"AnOutputWhoseOriginalAnotherRunRemovedIsNotReplaced",
     recorded(Record::removed, Output::whole,
              {.overwrite = true, .input = Input::unread, .check = Check::good})},
    {"WhatAnotherRunHasJustEncodedIsCompared",
     known({.skip_done = true, .renewed = true, .input = Input::same, .check = Check::good})},
    {"AVerifiedEncodingGetsItsName", {.input = Input::unread, .check = Check::good}},
    {"AnOnlyCopyThatIsGoneIsMissed",
     recorded(Record::removed, Output::absent, {.skip_done = true, .input = Input::gone})},
    {"ARemovedOriginalIsSkipped",
     recorded(Record::removed, Output::whole, {.skip_done = true, .input = Input::gone})},
    {"ARemovedOriginalIsCalledRemoved", recorded(Record::removed, Output::whole, {.input = Input::gone})},
    {"AMissingVolumeFails", {.input = Input::gone}},
    {"AVolumeIsOpened", {}},
    {"ADirectoryIsNoOutput", {.overwrite = true, .output = Output::irregular, .input = Input::unread}},
    {"WhatAppearedIsProvedIfItMayBeTheOnlyCopy",
     recorded(Record::removed, Output::appeared, {.input = Input::unread})},
    {"WhatAppearedIsCompared", {.output = Output::appeared, .input = Input::unread}},
    {"ALostOnlyCopyIsMadeAgain",
     recorded(Record::removed, Output::absent, {.overwrite = true, .input = Input::unread})},
    {"AnOriginalThatIsThereAgainIsComparedWithItsOutput",
     recorded(Record::removed, Output::whole, {.skip_done = true, .input = Input::touched})},
    {"NotEvenForceReplacesAnOnlyCopy",
     {.overwrite = true, .unreadable = true, .output = Output::other, .input = Input::unread}},
    {"ForceReplacesWhatWillAppear", {.overwrite = true, .input = Input::unread}},
    {"ANewVolumeIsEncoded", {.input = Input::unread}},
    {"ForceReplaces", {.overwrite = true, .output = Output::other, .input = Input::unread}},
    {"OptionsAreComparedBeforeAnOutputIsRefused", known({.input = Input::same})},
    {"AnOutputAsAskedExists", known({.input = Input::same, .options = Options::same})},
    {"AnOutputExists", {.output = Output::other, .input = Input::unread}},
    {"ForceReplacesWhatNoRecordDescribes",
     {.skip_done = true, .overwrite = true, .output = Output::other, .input = Input::unread}},
    {"AnOutputWithoutARecordIsCompared",
     {.skip_done = true, .output = Output::other, .input = Input::unread}},
    {"AnotherVolumeIsRefusedEvenWithForce",
     known({.skip_done = true, .overwrite = true, .input = Input::other})},
    {"OptionsAreComparedBeforeALineIsDone", known({.skip_done = true, .input = Input::same})},
    {"WhatACheckFoundDamagedIsNotSkipped",
     known({.skip_done = true, .found_damaged = true, .input = Input::same, .options = Options::same})},
    {"WhatIsDoneIsSkippedEvenWithForce",
     known({.skip_done = true, .overwrite = true, .input = Input::same, .options = Options::same})},
    {"OtherOptionsAreRefused",
     known({.skip_done = true, .input = Input::same, .options = Options::different})},
    {"ForceReplacesTheOutputOfAnotherVersion",
     known({.skip_done = true, .overwrite = true, .input = Input::unread, .options = Options::same})},
    {"SamplesAreComparedIfFilesChanged",
     recorded(Record::ok, Output::other, {.skip_done = true, .input = Input::unread})},
    {"AChangedVolumeIsRefused",
     recorded(Record::damaged, Output::whole, {.skip_done = true, .input = Input::changed})},
    {"ADamagedOutputIsReplaced",
     recorded(Record::damaged, Output::whole, {.skip_done = true, .input = Input::same})},
    {"AnOutputOfAnotherSizeIsReplaced",
     recorded(Record::ok, Output::other, {.skip_done = true, .input = Input::touched})},
    {"AVolumeWithNewTimesIsComparedWithItsOutput",
     known({.skip_done = true, .input = Input::touched, .options = Options::same})},
};

const std::vector<Case> removal_cases = {
    {"AnOutputThatAnotherRunReplacedIsNotCalledDamaged",
     known({.renewed = true, .input = Input::unread, .options = Options::same, .check = Check::damaged})},
    {"WhatAnotherRunRecordedIsNotVerified",
     known({.renewed = true, .input = Input::touched, .options = Options::same, .check = Check::good})},
    {"TheOriginalOfADamagedOutputIsKept",
     known({.input = Input::unread, .options = Options::same, .check = Check::damaged})},
    {"AnOnlyCopyThatIsGoneIsMissed", recorded(Record::removed, Output::absent, {.input = Input::gone})},
    {"ARemovedOriginalIsSkipped", recorded(Record::removed, Output::whole, {.input = Input::gone})},
    {"AMissingVolumeFails", {.input = Input::gone}},
    {"AnOriginalThatWasNeverEncodedIsKept", {.failed = true}},
    {"AnOriginalWithoutARecordIsKept", {.output = Output::other}},
    {"AnOriginalOfAnotherNameIsKept", {.record = Record::ok, .output = Output::whole}},
    {"AnOriginalWhoseLastEncodingFailedIsKept",
     known({.failed = true, .input = Input::touched, .options = Options::same, .check = Check::good})},
    {"AnOriginalOfWhichALineCannotBeReadIsKept",
     known({.unreadable = true, .input = Input::touched, .options = Options::same, .check = Check::good})},
    {"AVolumeIsOpened", known({})},
    {"AnotherVolumeIsKept", known({.input = Input::other})},
    {"OptionsAreComparedFirst", known({.input = Input::unread})},
    {"AnOriginalForWhichOtherOptionsAreAskedIsKept",
     known({.input = Input::unread, .options = Options::different})},
    {"AChangedOriginalIsKept", known({.input = Input::changed, .options = Options::same})},
    {"AVerifiedOriginalIsRemoved",
     known({.input = Input::touched, .options = Options::same, .check = Check::good})},
    {"AnOutputIsVerified",
     recorded(Record::damaged, Output::whole, {.input = Input::unread, .options = Options::same})},
};

class EncodingTable : public testing::TestWithParam<std::size_t> {};
TEST_P(EncodingTable, Row) {
  ASSERT_EQ(encoding_cases.size(), encoding_table().size());
  const Row& row = row_for(encoding_table(), encoding_cases[GetParam()].facts);
  EXPECT_EQ(&row, &encoding_table()[GetParam()]) << row.why;
}

class RemovalTable : public testing::TestWithParam<std::size_t> {};
TEST_P(RemovalTable, Row) {
  ASSERT_EQ(removal_cases.size(), removal_table().size());
  const Row& row = row_for(removal_table(), removal_cases[GetParam()].facts);
  EXPECT_EQ(&row, &removal_table()[GetParam()]) << row.why;
}

INSTANTIATE_TEST_SUITE_P(Of, EncodingTable, testing::Range(std::size_t{0}, encoding_cases.size()),
                         [](const auto& test) { return encoding_cases[test.param].name; });
INSTANTIATE_TEST_SUITE_P(Of, RemovalTable, testing::Range(std::size_t{0}, removal_cases.size()),
                         [](const auto& test) { return removal_cases[test.param].name; });

/// All combinations of facts.
void for_all(const std::function<void(const Facts&)>& check) {
  constexpr int count = 128 * 4 * 5 * 7 * 3 * 3;
  for (int number = 0; number < count && !testing::Test::HasFailure(); ++number) {
    int rest = number;
    const auto next = [&](int values) {
      const int value = rest % values;
      rest /= values;
      return value;
    };
    check({.skip_done = next(2) == 1,
           .overwrite = next(2) == 1,
           .record = static_cast<Record>(next(4)),
           .same_input = next(2) == 1,
           .failed = next(2) == 1,
           .unreadable = next(2) == 1,
           .renewed = next(2) == 1,
           .found_damaged = next(2) == 1,
           .output = static_cast<Output>(next(5)),
           .input = static_cast<Input>(next(7)),
           .options = static_cast<Options>(next(3)),
           .check = static_cast<Check>(next(3))});
  }
}

std::string shown(const Facts& f) {
  std::string text;
  for (const int fact :
       {int{f.skip_done}, int{f.overwrite}, static_cast<int>(f.record), int{f.same_input}, int{f.failed},
        int{f.unreadable}, int{f.renewed}, int{f.found_damaged}, static_cast<int>(f.output),
        static_cast<int>(f.input), static_cast<int>(f.options), static_cast<int>(f.check)})
    text += " " + std::to_string(fact);
  return "facts" + text;
}

bool implies(bool one, bool other) { return !one || other; }

bool is_one_of(Action action, const std::set<Action>& actions) { return actions.contains(action); }

bool is_file(Output output) {
  return output == Output::whole || output == Output::other || output == Output::appeared;
}

/// False if nothing gathers such facts.
bool are_possible(const Facts& f) {
  const bool is_compared = f.input == Input::same || f.input == Input::touched || f.input == Input::changed ||
                           f.input == Input::other;
  if (f.record == Record::none && (f.same_input || f.output == Output::whole || is_compared)) return false;
  if (f.renewed && (f.check == Check::none || f.record == Record::none)) return false;
  return f.check == Check::none || (f.input != Input::gone && f.input != Input::unseen);
}

const std::set<Action> questions = {Action::look, Action::compare_options, Action::compare_samples,
                                    Action::verify};

TEST(BothTables, HaveARowForAllFactsAndNoneThatNothingReaches) {
  for (const auto table : {encoding_table(), removal_table()}) {
    EXPECT_FALSE(std::string(table.back().why).empty());
    std::set<const Row*> reached;
    for_all([&](const Facts& f) {
      EXPECT_TRUE(table.back().matches(f)) << shown(f);
      if (are_possible(f)) reached.insert(&row_for(table, f));
    });
    for (const Row& row : table) EXPECT_TRUE(reached.contains(&row)) << row.why;
  }
}

TEST(BothTables, AskOnlyForWhatIsNotKnown) {
  for (const auto table : {encoding_table(), removal_table()})
    for_all([&](const Facts& f) {
      const Action action = decide(table, f);
      EXPECT_TRUE(implies(action == Action::look, f.input == Input::unseen || f.input == Input::gone))
          << shown(f);
      EXPECT_TRUE(implies(action == Action::compare_options, f.options == Options::unread)) << shown(f);
      EXPECT_TRUE(implies(action == Action::compare_samples, f.input == Input::unread)) << shown(f);
      EXPECT_TRUE(implies(action == Action::verify, f.check == Check::none || f.input != Input::touched))
          << shown(f);
    });
}

TEST(BothTables, NeverDoTheWorkOfTheOtherOne) {
  for_all([&](const Facts& f) {
    EXPECT_FALSE(is_one_of(decide(encoding_table(), f), {Action::verify, Action::remove})) << shown(f);
    EXPECT_FALSE(is_one_of(decide(removal_table(), f),
                           {Action::encode, Action::replace, Action::name, Action::adopt, Action::prove}))
        << shown(f);
  });
}

TEST(EncodingTableLaws, NothingReplacesWhatMayBeTheOnlyCopy) {
  for_all([&](const Facts& f) {
    const Action action = decide(encoding_table(), f);
    if (!f.only_copy()) return;
    EXPECT_NE(action, Action::replace) << shown(f);
    EXPECT_NE(action, Action::adopt) << shown(f);
    EXPECT_TRUE(implies(action == Action::encode || action == Action::name, f.output == Output::absent))
        << shown(f);
  });
}

TEST(EncodingTableLaws, WithoutForceOnlyABadOutputOfTheSameVolumeIsReplaced) {
  for_all([&](const Facts& f) {
    if (decide(encoding_table(), f) != Action::replace || f.overwrite) return;
    EXPECT_TRUE(f.skip_done && f.of_line() && f.same_input) << shown(f);
    EXPECT_TRUE(f.record == Record::damaged || f.output == Output::other) << shown(f);
    EXPECT_TRUE(f.input == Input::same || f.input == Input::touched) << shown(f);
  });
}

TEST(EncodingTableLaws, NotEvenForceReplacesWhatIsNotAFile) {
  for_all([&](const Facts& f) {
    if (f.output != Output::irregular || f.check != Check::none) return;
    EXPECT_TRUE(is_one_of(decide(encoding_table(), f),
                          {Action::look, Action::missing, Action::missing_copy, Action::irregular}))
        << shown(f);
  });
}

TEST(EncodingTableLaws, WithSkipDoneAnotherVolumeNeverReplacesTheOneOfARecord) {
  for_all([&](const Facts& f) {
    if (!f.skip_done || !f.of_line() || f.input != Input::other || f.check != Check::none) return;
    EXPECT_TRUE(implies(f.output == Output::whole || f.output == Output::other,
                        decide(encoding_table(), f) == Action::other_volume))
        << shown(f);
  });
}

TEST(EncodingTableLaws, OnlyWhatIsDoneIsSkipped) {
  for_all([&](const Facts& f) {
    if (decide(encoding_table(), f) != Action::skip) return;
    EXPECT_TRUE(f.skip_done && f.output == Output::whole) << shown(f);
    const bool was_removed = f.record == Record::removed && f.input == Input::gone;
    const bool is_done = f.record == Record::ok && f.same_input && !f.unreadable && f.input == Input::same &&
                         f.options == Options::same && !f.found_damaged;
    EXPECT_TRUE(was_removed || is_done) << shown(f);
  });
}

TEST(EncodingTableLaws, OnlyAVerifiedEncodingGetsTheName) {
  for_all([&](const Facts& f) {
    const Action action = decide(encoding_table(), f);
    EXPECT_EQ(f.check == Check::good, is_one_of(action, {Action::name, Action::new_only_copy}) ||
                                          (action == Action::adopt && f.renewed && f.check == Check::good))
        << shown(f);
    // Without -f, nothing of another run is replaced.
    EXPECT_TRUE(implies(action == Action::name && !f.overwrite && f.renewed && f.record == Record::ok,
                        f.output != Output::whole))
        << shown(f);
  });
}

TEST(EncodingTableLaws, WhatIsComparedIsThereAndWhatIsEncodedIsNot) {
  for_all([&](const Facts& f) {
    const Action action = decide(encoding_table(), f);
    EXPECT_TRUE(implies(is_one_of(action, {Action::adopt, Action::prove}), is_file(f.output))) << shown(f);
    EXPECT_TRUE(implies(action == Action::encode, f.output == Output::absent)) << shown(f);
    EXPECT_TRUE(implies(action == Action::exists_as_asked,
                        f.record == Record::ok && f.of_line() && f.options == Options::same))
        << shown(f);
  });
}

TEST(RemovalTableLaws, AnOriginalIsRemovedIfAndOnlyIfAllAgree) {
  for_all([&](const Facts& f) {
    const bool all_agree = f.check == Check::good && f.input == Input::touched &&
                           f.options == Options::same && f.record != Record::none && f.same_input &&
                           !f.failed && !f.unreadable && !f.renewed;
    EXPECT_EQ(decide(removal_table(), f) == Action::remove, all_agree) << shown(f);
  });
}

TEST(RemovalTableLaws, OnlyWhatWasRemovedIsSkipped) {
  for_all([&](const Facts& f) {
    if (decide(removal_table(), f) != Action::skip) return;
    EXPECT_TRUE(f.record == Record::removed && f.input == Input::gone && f.output == Output::whole)
        << shown(f);
  });
}

TEST(RemovalTableLaws, NoOptionOfTheEncodingMatters) {
  for_all([&](const Facts& f) {
    Facts plain = f;
    plain.skip_done = plain.overwrite = false;
    EXPECT_EQ(decide(removal_table(), f), decide(removal_table(), plain)) << shown(f);
  });
}

// No question is asked twice: after at most five answers, whatever they are, a line is done or fails.
TEST(BothTables, ComeToAnEnd) {
  const std::function<int(std::span<const Row>, Facts)> longest = [&](std::span<const Row> table, Facts f) {
    const Action action = decide(table, f);
    if (!questions.contains(action)) return 0;
    int most = 0;
    const auto answer = [&](const Facts& next) { most = std::max(most, longest(table, next)); };
    const auto answer_with = [&](std::initializer_list<Input> inputs) {
      for (const Input input : inputs) {
        f.input = input;
        answer(f);
      }
    };
    if (action == Action::look) answer_with({Input::same, Input::unread, Input::other});
    if (action == Action::compare_samples) answer_with({Input::touched, Input::changed});
    if (action == Action::compare_options) {
      f.options = Options::same;
      answer(f);
      f.options = Options::different;
      answer(f);
    }
    if (action == Action::verify) {
      answer_with({Input::changed});
      f.check = Check::good;
      answer_with({Input::touched});
      f.check = Check::damaged;
      answer(f);
    }
    return most + 1;
  };
  for (const auto table : {encoding_table(), removal_table()})
    for_all([&](const Facts& f) {
      if (f.check != Check::none) return;
      EXPECT_LE(longest(table, f), 5) << shown(f);
    });
}

}  // namespace
}  // namespace tagrid::archive
