// What is done with a line of a list: facts in, action out. Both passes of an archive decide here and nowhere
// else. One encodes the volume of the line, the other removes its original. Nothing here reads a file.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <span>

namespace tagrid::archive {

/// What the newest record that describes the output says of it.
enum class Record : std::uint8_t {
  none,     ///< no record describes it
  ok,       ///< it was encoded and verified
  damaged,  ///< it was found damaged when its original was to be removed
  removed,  ///< its original was removed
};

/// What is under the name of the output.
enum class Output : std::uint8_t {
  absent,
  whole,      ///< a file of the size that its record states
  other,      ///< a file of another size, or without a record
  irregular,  ///< something that is not a file
  appeared,   ///< a file that another run made while this one encoded the volume
};

/// The volume of the line, compared with the files in the record.
enum class Input : std::uint8_t {
  unseen,   ///< it was not opened yet
  gone,     ///< nothing is there
  same,     ///< its files have the same paths, sizes and times
  unread,   ///< they do not, or there is no record; samples were not compared
  touched,  ///< only times differ: samples were compared
  changed,  ///< its size, type, samples, or the number or sizes of its files differ
  other,    ///< it has none of these files
};

/// The options of the line, compared with those in the record.
enum class Options : std::uint8_t { unread, same, different };

/// What this run found about the output.
enum class Check : std::uint8_t {
  none,     ///< it was not checked yet
  damaged,  ///< it is not what was written
  good,     ///< it was decoded and compared with the volume
};

/// All that decides about a line.
struct Facts {
  bool skip_done = false;  ///< --skip-done
  bool overwrite = false;  ///< -f
  Record record = Record::none;
  bool same_input = false;     ///< the record is of the input of the line
  bool failed = false;         ///< the last encoding to this output failed
  bool unreadable = false;     ///< a line of the records that cannot be read may be newer than the record
  bool renewed = false;        ///< another run recorded the output since this one decided
  bool found_damaged = false;  ///< the last check of the output says so
  Output output = Output::absent;
  Input input = Input::unseen;
  Options options = Options::unread;
  Check check = Check::none;

  /// The record is of this line, and nothing may say that the original was removed.
  bool of_line() const {
    return same_input && !only_copy() && (record == Record::ok || record == Record::damaged);
  }
  /// The output may be all that is left of a volume.
  bool only_copy() const { return record == Record::removed || unreadable; }
};

enum class Action : std::uint8_t {
  // One more fact is needed. Then the table is asked again.
  look,             ///< opens the volume
  compare_options,  ///< compares the options with the record
  compare_samples,  ///< compares the samples with the record
  verify,           ///< decodes the output, and compares it with the volume
  // The line is done.
  skip,     ///< there is nothing to do
  encode,   ///< encodes the volume to a new file
  replace,  ///< encodes the volume, and replaces the file that may be there
  name,     ///< gives the verified encoding its name
  adopt,    ///< compares the output with the volume, and records it
  prove,    ///< the same, for an output that may be the only copy
  remove,   ///< records the removal, and removes the original
  // The line fails. The original and the output stay as they are.
  missing_copy,     ///< the original was removed, and the output is gone, or is not what it was
  was_removed,      ///< the original was removed on purpose
  missing,          ///< there is no volume
  irregular,        ///< the output is not a file
  only_copy,        ///< the output may be the only copy of another volume
  new_only_copy,    ///< the same, since another run removed the original a moment ago
  exists,           ///< the output exists
  exists_as_asked,  ///< it exists, and its record says that it is what was asked for
  other_options,    ///< the output was encoded with other options
  other_volume,     ///< the volume is not the one that was encoded
  changed,          ///< the volume has changed since it was encoded
  found_damaged,    ///< the last check found the output damaged
  no_record,        ///< no record says that the volume was encoded
  never_encoded,    ///< the only encoding failed
  failed_since,     ///< the last encoding failed
  other_input,      ///< the output was made from another input
  unreadable,       ///< a line of the records that cannot be read may be newer
  damaged,          ///< the output is not what was written
  encoded_again,    ///< another run replaced the output
  recorded_again,   ///< another run recorded the output
};

/// Some of the values of a fact; all if nothing is given.
template <class Value>
class OneOf {
 public:
  constexpr OneOf() = default;
  constexpr OneOf(Value value) : bits_(bit(value)) {}
  constexpr OneOf(std::initializer_list<Value> values) : bits_(0) {
    for (const Value value : values) bits_ |= bit(value);
  }
  constexpr bool contains(Value value) const { return (bits_ & bit(value)) != 0; }

 private:
  static constexpr unsigned bit(Value value) { return 1U << static_cast<unsigned>(value); }

  unsigned bits_ = ~0U;
};

/// A row of a table: if all facts are among these, this is the action.
struct Row {
  Action then;
  const char* why;
  OneOf<bool> skip_done = {}, overwrite = {};
  OneOf<Record> record = {};
  OneOf<bool> same_input = {}, failed = {}, unreadable = {}, renewed = {}, found_damaged = {}, of_line = {},
              only_copy = {};
  OneOf<Output> output = {};
  OneOf<Input> input = {};
  OneOf<Options> options = {};
  OneOf<Check> check = {};

  bool matches(const Facts& facts) const;
};

/// Of the pass that encodes, and of the one that removes originals. The first row that matches counts. The
/// last row matches everything.
std::span<const Row> encoding_table();
std::span<const Row> removal_table();

/// The row that counts.
const Row& row_for(std::span<const Row> table, const Facts& facts);

inline Action decide(std::span<const Row> table, const Facts& facts) { return row_for(table, facts).then; }

}  // namespace tagrid::archive
