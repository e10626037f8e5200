#include "tools/catalogue/move.h"

#include <filesystem>

#include "io/text/paths.h"
#include "io/text/text.h"
#include "tools/archive/record_line.h"
#include "tools/catalogue/records_editor.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

/// Paths with another beginning.
struct Renaming {
  std::string folder;  ///< to which relative names are relative
  std::string from, to;

  /// True if the name was below `from`, and is changed.
  bool apply(nlohmann::ordered_json& text) const {
    const std::string name = name_of_text(text.get<std::string>());
    if (name.starts_with(keyed_mark)) return false;
    const std::string path = path_in_records(name, folder);
    const std::string beginning = from == "/" ? from : from + "/";
    if (path != from && !path.starts_with(beginning)) return false;
    const std::string moved = path == from ? to : path_in(to, path.substr(beginning.size()));
    text = text_of_name(is_absolute(path_of(name)) ? moved : name_in_records(moved, folder));
    return true;
  }
};

}  // namespace

Moved move_originals(const std::string& folder, const std::string& from, const std::string& to,
                     const std::string& keys) {
  Moved moved;
  RecordsEditor records(folder, keys);
  const Renaming renaming = {canonical_folder(folder), from, to};
  moved.unknown = records.prepare([&](nlohmann::ordered_json& json) {
    if (!json.contains("input") || !json["input"].is_string()) return Edit::keep;
    ++moved.records;
    bool is_changed = renaming.apply(json["input"]);
    if (json.contains("input_files") && json["input_files"].is_array())
      for (nlohmann::ordered_json& file : json["input_files"])
        if (file.is_object() && file.contains("path") && file["path"].is_string())
          is_changed = renaming.apply(file["path"]) || is_changed;
    if (is_changed) ++moved.changed;
    return is_changed ? Edit::change : Edit::keep;
  });
  records.commit();
  return moved;
}

}  // namespace tagrid
