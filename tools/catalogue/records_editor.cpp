#include "tools/catalogue/records_editor.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/temporaries.h"
#include "io/system/files.h"
#include "tools/catalogue/lines.h"
#include "tools/report/report.h"

namespace tagrid {

RecordsEditor::RecordsEditor(const std::string& folder) {
  for (const LineFileName& name : line_files_in(folder)) {
    paths_.push_back(folder + "/" + name.name);
    held_.push_back(std::make_unique<LineFile>(paths_.back()));
  }
  remove_abandoned_files(paths_);
  // A killed run may also have left a file as it was before: it has what was to be forgotten. A file of records has its
  // name at all times, so no such file is the only one.
  std::vector<FolderEntry> entries;
  if (!files().list(folder, entries)) throw world_error("cannot read", folder, errno);
  for (const FolderEntry& entry : entries)
    if (const auto target = target_of_older(entry.name);
        target && std::ranges::find(paths_, folder + "/" + std::string(*target)) != paths_.end())
      files().unlink(folder + "/" + entry.name);
}

RecordsEditor::Rewriting::Rewriting(const std::string& path)
    : path_(path), lines_(path, read_), file_(path, true, {.like = attributes_of(path)}) {}

bool RecordsEditor::Rewriting::next(std::string& line) {
  if (!lines_.next(line)) return false;
  // Its content is not known, and a file without it would not be what it was.
  if (line.empty())
    throw BrokenInput(
        fmt::format("{}: is too long for a record; remove the line, and repeat the command", place()));
  return true;
}

std::string RecordsEditor::Rewriting::place() const { return fmt::format("{}: line {}", path_, read_.lines); }

void RecordsEditor::Rewriting::put(const nlohmann::ordered_json& json) {
  is_changed_ = true;
  file_.write(written_json(json) + "\n");
}

void RecordsEditor::Rewriting::finish() {
  if (is_changed_) file_.commit();
}

}  // namespace tagrid
