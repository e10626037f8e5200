#include "tools/catalogue/records_editor.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <optional>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/temporaries.h"
#include "io/system/files.h"
#include "tools/catalogue/lines.h"
#include "tools/report/report.h"

namespace tagrid {
namespace {

/// The owner and the permissions, but not the times: programs see by these that a file was written.
std::optional<FileAttributes> like(const std::string& path) {
  auto attributes = attributes_of(path);
  if (attributes) {
    const double now = seconds_since_1970(), seconds = std::floor(now);
    attributes->accessed = attributes->modified = {static_cast<std::int64_t>(seconds),
                                                   static_cast<std::int64_t>((now - seconds) * 1e9)};
  }
  return attributes;
}

}  // namespace

RecordsEditor::RecordsEditor(const std::string& folder, const std::string& keys) {
  for (const LineFileName& name : line_files_in(folder)) {
    const std::string path = folder + "/" + name.name;
    refuse_link(path);
    paths_.push_back(path);
    held_.push_back(std::make_unique<HeldByName>(path));
  }
  if (!keys.empty()) {
    refuse_link(keys);
    paths_.push_back(keys);
    held_.push_back(std::make_unique<HeldByName>(keys));
  }
  // A file of records has its name at all times, so one that was set aside is not the only one.
  remove_leftovers(folder, paths_);
}

void RecordsEditor::commit() {
  for (const auto& file : rewritten_) file->commit();
  // On some systems, a file that was replaced has a name until it is closed.
  rewritten_.clear();
  held_.clear();
}

int RecordsEditor::nesting(std::string_view line) {
  int depth = 0, most = 0;
  bool is_text = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (is_text && c == '\\')
      ++i;
    else if (c == '"')
      is_text = !is_text;
    else if (!is_text && (c == '{' || c == '['))
      most = std::max(most, ++depth);
    else if (!is_text && (c == '}' || c == ']'))
      --depth;
  }
  return most;
}

RecordsEditor::Rewriting::Rewriting(const std::string& path)
    : path_(path), lines_(path, read_, true), file_(path, true, {.like = like(path)}) {}

bool RecordsEditor::Rewriting::next(std::string& line) {
  if (!lines_.next(line)) return false;
  // Its content is not known, and a file without it would not be what it was.
  if (line.empty())
    throw BrokenInput("{}: is too long for a record; remove the line, and repeat the command", place());
  if (!line.ends_with('\n')) line += '\n';
  return true;
}

std::string RecordsEditor::Rewriting::place() const { return fmt::format("{}: line {}", path_, read_.lines); }

void RecordsEditor::Rewriting::put(const nlohmann::ordered_json& json) {
  is_changed_ = true;
  file_.write(written_json(json) + "\n");
}

void RecordsEditor::Rewriting::commit() {
  if (is_changed_) file_.commit();
}

void remove_leftovers(const std::string& folder, const std::vector<std::string>& paths) {
  remove_abandoned_files(paths);
  std::vector<FolderEntry> entries;
  if (!files().list(folder, entries)) throw world_error("cannot read", folder, errno);
  for (const FolderEntry& entry : entries)
    if (const auto target = target_of_older(entry.name);
        target && std::ranges::find(paths, folder + "/" + std::string(*target)) != paths.end())
      files().unlink(folder + "/" + entry.name);
}

}  // namespace tagrid
