// Changes records of an archive that were written: to forget volumes, and when originals have moved.
#pragma once

#include <cstddef>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "io/files/held_files.h"
#include "io/files/output_file.h"
#include "tools/archive/record_line.h"

namespace tagrid {

/// What becomes of a line.
enum class Edit { keep, drop, change };

/// Holds all files of records and events of an archive, so that no run adds to them meanwhile.
class RecordsEditor {
 public:
  /// Removes what a killed editor left beside them. Throws HeldByAnother if a run has one of them, UsageError if one is
  /// a link, and WorldError. `keys`: the path of a key file whose halves of these records are edited like them; "":
  /// none.
  explicit RecordsEditor(const std::string& folder, const std::string& keys = "");

  /// Calls edit(json) for each record and event of an output: it returns what becomes of the line, and has changed
  /// `json` if that is Edit::change. The new files are complete after this, but get their names by commit(). Returns
  /// the lines that cannot be read, which stay: "results.jsonl: line 3".
  template <class Change>
  std::vector<std::string> prepare(Change edit) {
    std::vector<std::string> unknown;
    for (const std::string& path : paths_) {
      auto file = std::make_unique<Rewriting>(path);
      for (std::string line; file->next(line);) {
        if (nesting(line) > most_nesting) {
          unknown.push_back(file->place());
          file->keep(line);
          continue;
        }
        nlohmann::ordered_json json = nlohmann::ordered_json::parse(line, nullptr, false);
        const bool has_output = json.is_object() && json.contains("output") && json["output"].is_string();
        // Newer versions may record events without an output.
        if (!has_output && !(json.is_object() && json.contains("event"))) unknown.push_back(file->place());
        switch (has_output ? edit(json) : Edit::keep) {
          case Edit::keep:
            file->keep(line);
            break;
          case Edit::drop:
            file->drop();
            break;
          case Edit::change:
            file->put(json);
            break;
        }
      }
      rewritten_.push_back(std::move(file));
    }
    return unknown;
  }
  /// Gives them their names. No file is held after this.
  void commit();

 private:
  class Rewriting {
   public:
    explicit Rewriting(const std::string& path);
    bool next(std::string& line);
    std::string place() const;
    void keep(const std::string& line) { file_.write(std::string_view(line)); }
    void drop() { is_changed_ = true; }
    void put(const nlohmann::ordered_json& json);
    void commit();

   private:
    std::string path_;
    LinesRead read_;
    NewLines lines_;
    OutputFile file_;
    bool is_changed_ = false;
  };

  static constexpr int most_nesting = 32;
  /// The depth of brackets: what is nested too deeply would need too much of the stack.
  static int nesting(std::string_view line);

  std::vector<std::string> paths_;
  std::vector<std::unique_ptr<HeldByName>> held_;
  std::vector<std::unique_ptr<Rewriting>> rewritten_;
};

/// Removes files that killed runs left of `paths`, and older files of these names that they set aside.
void remove_leftovers(const std::string& folder, const std::vector<std::string>& paths);

}  // namespace tagrid
