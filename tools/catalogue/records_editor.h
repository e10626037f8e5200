// Changes records of an archive that were written: to forget volumes, and when originals have moved.
#pragma once

#include <cstddef>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "io/files/held_files.h"
#include "io/files/output_file.h"
#include "tools/archive/record_line.h"

namespace tagrid {

/// Holds all files of records and events of an archive, so that no run adds to them meanwhile.
class RecordsEditor {
 public:
  /// Throws HeldByAnother if a run has one of them, and WorldError.
  explicit RecordsEditor(const std::string& folder);

  /// Calls edit(json) for each record and event. It changes them in place, and returns false if a line is to go. A file
  /// with changes is written anew, and gets its name when it is complete. Returns the lines that are no records, which
  /// stay: "results.jsonl: line 3".
  template <class Edit>
  std::vector<std::string> rewrite(Edit edit) {
    std::vector<std::string> unknown;
    for (const std::string& path : paths_) {
      Rewriting file(path);
      for (std::string line; file.next(line);) {
        nlohmann::ordered_json json = nlohmann::ordered_json::parse(line, nullptr, false);
        if (!json.is_object() || !json.contains("output") || !json["output"].is_string()) {
          unknown.push_back(file.place());
          file.keep(line);
          continue;
        }
        const nlohmann::ordered_json before = json;
        if (!edit(json))
          file.drop();
        else if (json == before)
          file.keep(line);
        else
          file.put(json);
      }
      file.finish();
    }
    return unknown;
  }

 private:
  class Rewriting {
   public:
    explicit Rewriting(const std::string& path);
    bool next(std::string& line);
    std::string place() const;
    void keep(const std::string& line) { file_.write(std::string_view(line)); }
    void drop() { is_changed_ = true; }
    void put(const nlohmann::ordered_json& json);
    void finish();

   private:
    std::string path_;
    LinesRead read_;
    NewLines lines_;
    OutputFile file_;
    bool is_changed_ = false;
  };

  std::vector<std::string> paths_;
  std::vector<std::unique_ptr<LineFile>> held_;
};

}  // namespace tagrid
