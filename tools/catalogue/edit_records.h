// Changes the records of an archive as a whole: to forget volumes, and when originals have moved.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace tagrid {

/// Holds all files of records and events of an archive, so that no run can add to them, and writes them anew.
class RecordsEditor {
 public:
  /// Throws HeldByAnother if a run has one of them.
  explicit RecordsEditor(const std::string& folder);
  ~RecordsEditor();
  RecordsEditor(const RecordsEditor&) = delete;
  RecordsEditor& operator=(const RecordsEditor&) = delete;

  /// Writes each file that changes under a temporary name, and then gives it its own. `edit(json)` changes the record in
  /// place, and returns false if its line is to go. Lines that are no records stay; their number is returned.
  template <class Edit>
  std::size_t rewrite(Edit edit) {
    std::size_t unknown = 0;
    for (const std::string& path : paths_) {
      Rewriting file(path);
      for (std::string line; file.next(line);) {
        nlohmann::ordered_json json = nlohmann::ordered_json::parse(line, nullptr, false);
        if (!json.is_object() || !json.contains("output")) {
          ++unknown;
          file.keep(line);
          continue;
        }
        const nlohmann::ordered_json before = json;
        if (!edit(json)) continue;
        json == before ? file.keep(line) : file.put(json);
      }
      file.finish();
    }
    return unknown;
  }
