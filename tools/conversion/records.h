// What `convert` writes down of every volume, and what a later run learns from that. A record is a line of
// JSON; docs/archives.md says what is in it.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tools/options/encoding_options.h"

namespace tagrid {

/// A file that a volume is in, as it was when it was encoded.
struct InputFile {
  std::string path;
  std::uint64_t bytes = 0;
  std::int64_t modified = 0;  ///< nanoseconds since 1970

  bool operator==(const InputFile&) const = default;
};

/// The files as they are now. Throws WorldError for one that is not there, UsageError for what is no file.
std::vector<InputFile> look_at(const std::vector<std::string>& files);

nlohmann::ordered_json json_of(const std::vector<InputFile>& files);

/// An output that was encoded and verified, and what became of it: the newest record of it that says so.
struct KnownOutput {
  enum class State {
    ok,
    damaged,  ///< found to be so when its original was to be removed
    removed,  ///< its original was
  };
  State state = State::ok;
  std::string input;
  OptionTexts options;
  std::vector<InputFile> input_files;
  bool headerless = false;  ///< the options said how its samples lie
  std::uint64_t bytes_out = 0;
  std::string input_checksum, output_checksum;
  double finished = 0;  ///< seconds since 1970
  /// A later run failed with it, and none since found it as it should be.
  bool failed_since = false;
  std::string record;  ///< all of it, as its line
};

/// The keys of a record that say what the output is; null where that is not known.
inline constexpr std::array output_keys = {"dims",       "type",       "settings",    "achieved",
                                           "bytes_in",   "bytes_out",  "input_files", "headerless",
                                           "input_xxh3", "output_xxh3"};

/// Says in `record` what the output is, as an earlier record has it.
void add_output(const KnownOutput& known, nlohmann::ordered_json& record);

/// The outputs that the records in a folder tell of: of this run's file and of all others there, whatever the
/// number of shards was.
class KnownOutputs {
 public:
  /// Reads every results*.jsonl in `folder`. Lines that are no records, such as half ones, count as not
  /// there.
  explicit KnownOutputs(const std::string& folder);

  /// `output` is a name in the folder; nullptr where nothing is known.
  const KnownOutput* find(const std::string& output) const;

 private:
  struct LastRun {
    double finished = 0;
    bool failed = false;
  };
  void read(const std::string& path);
  void note_failure(const nlohmann::ordered_json& record);

  std::map<std::string, KnownOutput> outputs_;
  std::map<std::string, LastRun> last_runs_;  ///< that encoded, or tried or had no need to
};

/// A checksum as records have it: 16 hexadecimal digits.
std::string checksum_text(std::uint64_t checksum);

/// Now, in seconds since 1970.
double seconds_since_1970();

}  // namespace tagrid
