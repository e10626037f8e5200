// The records that `convert` writes and later runs read: lines of JSON, described in docs/archives.md.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "io/errors/errors.h"
#include "tools/archive/events.h"
#include "tools/archive/key_file.h"
#include "tools/archive/manifest.h"
#include "tools/archive/record_line.h"
#include "tools/archive/removal_table.h"
#include "tools/options/encoding_options.h"

namespace tagrid {

/// The files as they are now. Throws WorldError if one is missing, and UsageError if one is not a file.
std::vector<InputFile> look_at(const std::vector<std::string>& files);

/// Throws WorldError if nothing is at the path, and UsageError if it is neither a file nor a directory.
void require_file_or_folder(const std::string& path);

/// The directory to which paths in the records of a line are relative, so that outputs, records and
/// originals can move together: `folder`, that of the outputs. Returns "" if these paths are
/// absolute, because the list has an absolute path or because the two have only the root in common.
std::string base_of_records(const std::string& folder, const ManifestLine& line);
/// Names in records are those of text_of_name(); in memory they are the names themselves. `base`: see above.
nlohmann::ordered_json json_of(const std::vector<InputFile>& files, const std::string& base);
nlohmann::ordered_json json_of(const OptionTexts& options);

/// The keys of a record that describe the output; null if unknown.
inline constexpr std::array output_keys = {"dims",         "type",        "settings",   "achieved",
                                           "bytes_in",     "bytes_out",   "restorable", "why_not_restorable",
                                           "lossy_source", "input_files", "headerless", "input_xxh3",
                                           "output_xxh3"};

/// "b.dcm instead of a.dcm" if `files` are those of another volume: none of them was encoded. "" otherwise.
std::string other_volume(const KnownOutput& known, const std::vector<InputFile>& files);

/// True if there is a regular file of this size at the path.
bool is_file_of_size(const std::string& path, std::uint64_t bytes);

/// True if the output at the path has the size with which it was written. Parity that was added
/// since (`tagrid protect`) is ignored.
bool has_written_size(const KnownOutput& known, const std::string& path);
/// True if it also has the content. Throws WorldError.
bool is_as_written(const KnownOutput& known, const std::string& path);

/// Adds to `record` the description of the output from an earlier record.
void add_output(const KnownOutput& known, nlohmann::ordered_json& record);

/// Turns `record` into that of a volume for which there is nothing to do.
void skip(const KnownOutput& known, nlohmann::ordered_json& record);

/// The outputs in all records of a directory, whatever their number of shards.
class KnownOutputs {
 public:
  /// Reads every results*.jsonl in `folder`. Lines that are not records are left out; see unreadable(). `keys`: has the
  /// halves of records that an archive without names lacks, or is null; must outlive this.
  explicit KnownOutputs(const std::string& folder, KeyFile* keys = nullptr);

  /// Reads what was written since, also by other runs. References to an output then show its newest record.
  void read_more();

  /// `output` is a name in the directory; returns nullptr if nothing is known of it.
  const KnownOutput* find(const std::string& output) const;
  /// All of them, by their names in the directory.
  const std::map<std::string, KnownOutput>& all() const { return outputs_; }
  /// The line of its newest record; "" if nothing is known of it.
  std::string record_of(const std::string& output) const;
  /// True if the last check of the output, which is at `path`, found it damaged. It counts until the file is changed or
  /// has a newer record. Throws WorldError.
  bool was_found_damaged(const std::string& output, const std::string& path) const;
  /// The sequence of a record of `output` that this run writes.
  std::uint64_t next_sequence(const std::string& output) const;
  /// Why the last run that was to encode it failed; "" if it did not, or if the output was found good since.
  std::string last_failure(const std::string& output) const;
  /// Throws UsageError if records name their originals and there is a key file, or the other way round, or if it is the
  /// key file of another archive.
  void require_these_keys() const;
  /// How many files of records the directory has.
  std::size_t files() const { return files_.size(); }
  /// Lines that are not records, except half a last one: "out/results.jsonl: line 3 is not a record".
  const std::vector<std::string>& unreadable() const { return unreadable_; }
  /// The first such line that may be newer than the records of the output. It may have said that the original
  /// was removed. Returns "" if there is no such line.
  std::string possibly_newer(const std::string& output) const;

 private:
  struct LastRun {
    RecordTime time;
    std::string failure;
  };
  void read(const std::string& path);
  void read_checks(const std::string& path);
  void note(RecordLine record);

  KeyFile* keys_;
  std::size_t plain_ = 0, sealed_ = 0;      ///< records: that name originals, and that do not
  std::string foreign_;                     ///< the first one that is of another key file; "": none
  std::string given_;                       ///< the directory as the caller names it
  std::string folder_;                      ///< absolute
  std::map<std::string, LinesRead> files_;  ///< by path
  std::vector<std::string> unreadable_;
  /// By output: the parts of unreadable_ that come before its last record in a file; one part for
  /// each time that a file was read.
  std::map<std::string, std::map<std::size_t, std::size_t>> older_;
  std::map<std::string, KnownOutput> outputs_;
  std::map<std::string, LinesRead> events_;         ///< files of events, by path
  std::map<std::string, CheckEvent> checks_;        ///< the last ones, by output
  std::map<std::string, std::uint64_t> sequences_;  ///< the highest ones
  std::map<std::string, LastRun> last_runs_;  ///< last runs that encoded it, failed to, or had no need to
};

/// Sets the facts that follow from the records of the output of a line, and from what is at `path`, where the
/// output belongs.
void note_records(const KnownOutputs& known, const ManifestLine& line, const std::string& path,
                  archive::Facts& facts);
/// Reads what other runs recorded since, and sets these facts anew. `before`: record_of() when this run
/// decided.
void note_newer_records(KnownOutputs& known, const ManifestLine& line, const std::string& path,
                        const std::string& before, archive::Facts& facts);
/// Unseen or gone. A directory from which files were removed may still be there, with others; `run` limits
/// the memory of a look into it. Throws WorldError.
archive::Input input_of(const KnownOutputs& known, const ManifestLine& line, const RunOptions& run);

/// For Action::missing_copy.
BrokenInput missing_copy(const std::string& path);

/// A checksum as in records: 16 hexadecimal digits.
std::string checksum_text(std::uint64_t checksum);

}  // namespace tagrid
