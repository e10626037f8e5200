// The catalogue of an archive: what its records and its .tag files say, in an index that is brought up to date before
// it is asked. Records and files are the truth. The index, an SQLite file beside them, can be removed at any time.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tools/archive/key_file.h"
#include "tools/archive/manifest.h"
#include "tools/catalogue/database.h"
#include "tools/catalogue/query.h"

namespace tagrid {

/// The index, in the directory of the outputs.
inline constexpr const char* index_name = "archive.sqlite";

/// A volume of an archive: an output, a record of one, or both.
struct CatalogueEntry {
  std::string name;                    ///< of the output, in the directory
  std::string status;                  ///< see docs/archives.md: "ok", "missing" ...
  bool is_only_copy = false;           ///< its original was removed
  std::optional<std::uint64_t> bytes;  ///< of the output; nothing if it is gone
  std::int64_t modified = 0;           ///< nanoseconds since 1970
  std::string problem;  ///< why it cannot be read, or why it was not encoded; "" if nothing is wrong
  std::string patient, patient_id, study_date, modality, type;  ///< "" if unknown
  std::optional<double> bound;  ///< of stored samples; nothing: any error, or unknown
  std::uint64_t raw_bytes = 0;
  std::optional<double> checked;   ///< seconds since 1970
  std::string check;               ///< the result of the last check: "ok", "damaged"
  std::string input;               ///< path of the original; "" without a record
  std::optional<double> recorded;  ///< seconds since 1970
  std::uint64_t written = 0;       ///< bytes of the output without parity that was added, by its record
  std::string checksum;            ///< of these; "" without a record
  std::string facts;               ///< JSON; "" unless the query wants it, or if nothing is known
};

class Catalogue {
 public:
  /// Opens the index of the archive in `folder`, and brings it up to date. If the index is broken, it is made again. If
  /// it cannot be written, as on a read-only copy, a temporary one takes its place. `threads` read files. `keys`: with
  /// this key file, unless it is null, a temporary index also has the names that the archive lacks. Throws WorldError.
  Catalogue(const std::string& folder, int threads, KeyFile* keys = nullptr);

  /// Sentences for users on what is not in order: lines that are not records, and what became of the index.
  const std::vector<std::string>& remarks() const { return remarks_; }
  const std::string& folder() const { return folder_; }
  /// True if the key file names another patient than the header of the output does.
  bool is_disputed(const std::string& name) const { return disputed_.contains(name); }
  /// The path of an output.
  std::string path_of(const std::string& name) const;

  /// Calls use(entry) for the volumes that a query wants, sorted by name.
  template <class Use>
  void for_each(const Query& query, Use use) const {
    Statement rows = selected(query);
    while (rows.next()) {
      CatalogueEntry entry = entry_in(rows, query.wants_json);
      // Anybody may have written to the index.
      if (is_possible_output(entry.name)) use(std::move(entry));
    }
  }
  std::vector<CatalogueEntry> entries(const Query& query) const {
    std::vector<CatalogueEntry> all;
    for_each(query, [&](CatalogueEntry entry) { all.push_back(std::move(entry)); });
    return all;
  }

  /// Reads the conditions and the names that a user gave. Throws UsageError.
  Query query_of(const std::vector<std::string>& words) const;

 private:
  void open(const std::string& path);
  void copy_index();
  void update();
  void note_keys(KeyFile& keys);
  std::optional<std::string> output_named(const std::string& word) const;
  std::string key_meant(const std::string& key) const;
  Statement selected(const Query& query) const;
  static CatalogueEntry entry_in(const Statement& row, bool has_json);

  std::string folder_;
  int threads_;
  std::vector<std::string> remarks_;
  std::set<std::string> disputed_;
  std::optional<Database> database_;
};

}  // namespace tagrid
