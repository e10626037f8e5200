// One record of `convert`: a line of JSON that says what became of a volume. docs/archives.md describes it.
#pragma once

#include <compare>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/files/file_bytes.h"
#include "tools/archive/removal_table.h"
#include "tools/options/encoding_options.h"

namespace tagrid {

/// A file of a volume, as it was when it was encoded.
struct InputFile {
  std::string path;
  std::uint64_t bytes = 0;
  std::int64_t modified = 0;  ///< nanoseconds since 1970

  bool operator==(const InputFile&) const = default;
};

/// The absolute path of a directory of outputs without links, to which relative paths in its records are relative.
std::string canonical_folder(const std::string& folder);

/// The input of a record in an archive without names: this, and the 32 digits of its half in the key file; see
/// key_file.h. The files of the input are KEYED/0, KEYED/1 ...
inline constexpr std::string_view keyed_mark = "keyed:";

/// With a key file, the member of a record in memory that says whom its output shows; lines of an archive never have
/// it.
inline constexpr const char* subject_key = "subject";

/// The name of a file in records whose paths are relative to `base` ("": absolute), and the path for such a name; a key
/// stays as it is.
std::string name_in_records(const std::string& path, const std::string& base);
std::string path_in_records(const std::string& name, const std::string& base);

/// The highest sequence: a forged record must not make the next one the first. Programs that read JSON as doubles know
/// it exactly.
inline constexpr std::uint64_t last_sequence = (std::uint64_t{1} << 53) - 1;

/// When a record was written. Clocks of different machines disagree, so it is first compared how many records
/// of the same output were known then, one after the other: what a record rests on is never later than it.
struct RecordTime {
  std::uint64_t sequence = 0;  ///< 1 more than that of any record of the output that its run had read
  double finished = 0;         ///< seconds since 1970

  auto operator<=>(const RecordTime&) const = default;
};

/// An output that was encoded and verified, and its state: the newest record that describes it.
struct KnownOutput {
  archive::Record state = archive::Record::ok;
  std::string input;
  OptionTexts options;
  std::vector<InputFile> input_files;
  bool headerless = false;  ///< the options described the layout of its samples
  std::uint64_t bytes_out = 0;
  std::string input_checksum, output_checksum;
  RecordTime time;
  std::string record;  ///< the entire record, as its line
};

/// Now, in seconds since 1970, as records say when they were written.
double seconds_since_1970();

struct RecordLine {
  std::string output;  ///< its name in the directory of the outputs
  RecordTime time;
  std::string status;  ///< "ok", "failed" ...
  std::string error;   ///< why the work on it ended; "" if it did not
  /// What the record says of the output; nothing if it says only that nothing was done.
  std::optional<KnownOutput> known;
  /// True if the volume was to be encoded, was, or had no need to be; false if nothing was tried.
  bool is_attempt = false;

  /// Why such an attempt failed; "" if it did not.
  std::string failure() const;
};

/// "ok", "damaged" or "removed": the status in records of such an output; and the state for such a status, `ok` for
/// others.
const char* name_of(archive::Record state);
archive::Record record_named(std::string_view status);

/// Reads a line; paths in it are relative to `folder`, a canonical_folder(). Throws nlohmann::json::exception if it is
/// not a record.
RecordLine parse_record_line(std::string_view line, const std::string& folder);

/// Whether a record describes the output instead of the newest one so far. In one file, the later line is the newer
/// one. Of two simultaneous runs, one that removed an original counts: its output may be the only copy.
bool replaces(archive::Record record, const RecordTime& time, archive::Record newest,
              const RecordTime& time_of_newest);

/// How far a file of lines was read: to the end of its last complete line.
struct LinesRead {
  std::uint64_t bytes = 0, lines = 0;
};

/// The lines that were added to a file since it was read so far. Half a last line is not one: it is all that a killed
/// run wrote of a record.
class NewLines {
 public:
  /// `read` is moved on with each line. `with_rest`: what follows the last end of a line is a line, too. Throws
  /// WorldError, and UsageError if it is not a regular file.
  NewLines(const std::string& path, LinesRead& read, bool with_rest = false);
  /// Reads the next line, with its end. A line that is too long for a record is left empty. Returns false after the
  /// last one.
  bool next(std::string& line);

 private:
  std::optional<FileBytes> file_;  ///< nothing if the file has no new lines
  LinesRead& read_;
  bool with_rest_;
};

}  // namespace tagrid
