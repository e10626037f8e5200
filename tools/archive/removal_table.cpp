#include "tools/archive/removal_table.h"

#include <algorithm>

namespace tagrid::archive {
namespace {

constexpr OneOf<Output> anything = {Output::whole, Output::other, Output::irregular, Output::appeared};
constexpr OneOf<Output> not_whole = {Output::absent, Output::other, Output::irregular, Output::appeared};

// clang-format off
constexpr Row encoding_rows[] = {
    // The encoding was verified and waits for its name. No other process can name or remove a file now.
    {.then = Action::new_only_copy, .why = "another run removed the original of the older file",
     .only_copy = true, .output = anything, .check = Check::good},
    {.then = Action::adopt, .why = "without -f, what another run has just encoded is not replaced",
     .overwrite = false, .record = Record::ok, .renewed = true, .output = Output::whole,
     .check = Check::good},
    {.then = Action::name, .why = "nothing is lost",
     .check = Check::good},
    // Nothing is there.
    {.then = Action::missing_copy, .why = "the only copy is lost or damaged, which somebody must know",
     .record = Record::removed, .output = not_whole, .input = Input::gone},
    {.then = Action::skip, .why = "the original was removed on purpose",
     .skip_done = true, .record = Record::removed, .input = Input::gone},
    {.then = Action::was_removed, .why = "the original was removed on purpose, which the user may not know",
     .record = Record::removed, .input = Input::gone},
    {.then = Action::missing, .why = "there is no volume",
     .input = Input::gone},
    {.then = Action::look, .why = "the volume must be opened",
     .input = Input::unseen},
    {.then = Action::irregular, .why = "a directory or a pipe is not an output, and not even -f replaces it",
     .output = Output::irregular},
    // The output may be the only copy, or has just been made.
    {.then = Action::prove, .why = "it is not replaced, but may have this volume",
     .only_copy = true, .output = Output::appeared},
    {.then = Action::adopt, .why = "another run may have encoded the same volume",
     .output = Output::appeared},
    {.then = Action::encode, .why = "the only copy is lost, but a volume is there again",
     .only_copy = true, .output = Output::absent},
    {.then = Action::prove, .why = "the original may be there again",
     .skip_done = true, .only_copy = true},
    {.then = Action::only_copy, .why = "not even -f replaces the only copy",
     .only_copy = true},
    {.then = Action::replace, .why = "-f also replaces what appears during the encoding",
     .overwrite = true, .output = Output::absent},
    {.then = Action::encode, .why = "there is no output",
     .output = Output::absent},
    // There is a file under the name of the output.
    {.then = Action::replace, .why = "-f",
     .skip_done = false, .overwrite = true},
    {.then = Action::compare_options, .why = "the record may describe what is asked for",
     .skip_done = false, .record = Record::ok, .of_line = true, .options = Options::unread},
    {.then = Action::exists_as_asked, .why = "nothing is tried, so this says nothing against the record",
     .skip_done = false, .record = Record::ok, .of_line = true, .options = Options::same},
    {.then = Action::exists, .why = "only -f replaces it",
     .skip_done = false},
    // --skip-done.
    {.then = Action::replace, .why = "-f replaces what no record of this line describes",
     .overwrite = true, .of_line = false},
    {.then = Action::adopt, .why = "a run may have been killed before it recorded the output",
     .of_line = false},
    // A record of this line describes the output.
    {.then = Action::other_volume, .why = "a name that means another volume now replaces nothing",
     .input = Input::other},
    {.then = Action::compare_options, .why = "a good output is only replaced by what it is not",
     .record = Record::ok, .output = Output::whole, .options = Options::unread},
    {.then = Action::found_damaged,
     .why = "parity may bring back what the volume, whose samples are not compared, no longer has",
     .record = Record::ok, .found_damaged = true, .output = Output::whole, .input = Input::same,
     .options = Options::same},
    {.then = Action::skip, .why = "nothing has changed",
     .record = Record::ok, .output = Output::whole, .input = Input::same, .options = Options::same},
    {.then = Action::other_options, .why = "only -f replaces a good output",
     .overwrite = false, .record = Record::ok, .output = Output::whole, .options = Options::different},
    {.then = Action::replace, .why = "-f replaces the output of another version of the volume",
     .overwrite = true},
    {.then = Action::compare_samples, .why = "the volume may have been damaged since",
     .input = Input::unread},
    {.then = Action::changed, .why = "the output may be all that is left of the volume as it was",
     .input = Input::changed},
    {.then = Action::replace, .why = "the output was found damaged, and the volume is what was encoded",
     .record = Record::damaged},
    {.then = Action::replace, .why = "the output is not what was written, and the volume is what was encoded",
     .output = Output::other},
    {.then = Action::adopt, .why = "times of files changed, and nothing else"},
};

constexpr Row removal_rows[] = {
    // Other runs may have been at the output since it was looked at.
    {.then = Action::encoded_again, .why = "the output is that of another run, not a damaged one",
     .renewed = true, .check = Check::damaged},
    {.then = Action::recorded_again, .why = "this run has not verified what another one recorded",
     .renewed = true},
    {.then = Action::damaged, .why = "the output is not what was written",
     .check = Check::damaged},
    // Nothing is there.
    {.then = Action::missing_copy, .why = "the only copy is lost or damaged, which somebody must know",
     .record = Record::removed, .output = not_whole, .input = Input::gone},
    {.then = Action::skip, .why = "the original was removed on purpose",
     .record = Record::removed, .input = Input::gone},
    {.then = Action::missing, .why = "what is not there is not kept",
     .record = Record::none, .input = Input::gone},
    // What the records say.
    {.then = Action::never_encoded, .why = "no encoding succeeded",
     .record = Record::none, .failed = true},
    {.then = Action::no_record, .why = "nothing says that the volume was encoded",
     .record = Record::none},
    {.then = Action::other_input, .why = "the output was made from something else",
     .same_input = false},
    {.then = Action::failed_since, .why = "the volume or the disk may be broken since",
     .failed = true},
    {.then = Action::unreadable, .why = "the line may say that an encoding failed",
     .unreadable = true},
    // What the volume says.
    {.then = Action::look, .why = "its files must be known, and who else needs them",
     .input = {Input::unseen, Input::gone}},
    {.then = Action::other_volume, .why = "the name means another volume now",
     .input = Input::other},
    {.then = Action::compare_options, .why = "the output must be what is asked for now",
     .options = Options::unread},
    {.then = Action::other_options, .why = "a loss that is not asked for now must not become final",
     .options = Options::different},
    {.then = Action::changed, .why = "the output is of an earlier version of the volume",
     .input = Input::changed},
    {.then = Action::remove, .why = "the output has this volume, as asked, and every record agrees",
     .input = Input::touched, .check = Check::good},
    {.then = Action::verify, .why = "nothing is removed that was not compared"},
};
// clang-format on

}  // namespace

bool Row::matches(const Facts& facts) const {
  return skip_done.contains(facts.skip_done) && overwrite.contains(facts.overwrite) &&
         record.contains(facts.record) && same_input.contains(facts.same_input) &&
         failed.contains(facts.failed) && unreadable.contains(facts.unreadable) &&
         renewed.contains(facts.renewed) && found_damaged.contains(facts.found_damaged) &&
         of_line.contains(facts.of_line()) && only_copy.contains(facts.only_copy()) &&
         output.contains(facts.output) && input.contains(facts.input) && options.contains(facts.options) &&
         check.contains(facts.check);
}

std::span<const Row> encoding_table() { return encoding_rows; }

std::span<const Row> removal_table() { return removal_rows; }

const Row& row_for(std::span<const Row> table, const Facts& facts) {
  return *std::ranges::find_if(table, [&](const Row& row) { return row.matches(facts); });
}

}  // namespace tagrid::archive
