#include "tools/catalogue/forget.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <set>

#include "io/errors/errors.h"
#include "io/files/file_bytes.h"
#include "io/files/held_files.h"
#include "io/files/temporaries.h"
#include "io/parity/parity.h"
#include "io/system/files.h"
#include "io/text/text.h"
#include "tools/archive/manifest.h"
#include "tools/catalogue/records_editor.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

bool remove_if_there(const std::string& path) {
  if (files().unlink(path)) return true;
  if (errno != ENOENT) throw world_error("cannot remove", path, errno);
  return false;
}

/// Removes the directories of an output that are empty now.
void remove_empty_folders(const std::string& folder, const std::string& name) {
  for (fs::path below = fs::path(name).parent_path(); !below.empty(); below = below.parent_path()) {
    const std::string path = folder + "/" + below.string();
    if (!files().remove_folder(path)) return;
    sync_folder(folder_of(path));
  }
}

/// Removes an output, its parity beside it, and what killed runs left of it.
void remove_output(const Catalogue& catalogue, const CatalogueEntry& entry, Forgotten& forgotten) {
  const std::string path = catalogue.path_of(entry.name);
  require_own_folders(catalogue.folder(), entry.name);
  remove_abandoned_files({path, parity_beside(path)});
  remove_if_there(parity_beside(path));
  if (remove_if_there(path)) {
    ++forgotten.outputs;
    forgotten.bytes += entry.bytes.value_or(0);
  }
  sync_folder(folder_of(path));
  remove_empty_folders(catalogue.folder(), entry.name);
}

/// Texts that must not be found any more: names of outputs and patients, if no other volume has them.
std::set<std::string> names_of(const Catalogue& catalogue, const std::vector<CatalogueEntry>& entries,
                               const std::set<std::string>& outputs) {
  constexpr std::size_t least = 4;  // shorter ones are found anywhere
  std::set<std::string> names;
  for (const CatalogueEntry& entry : entries)
    for (const std::string& name : {entry.name, entry.patient, entry.patient_id})
      if (name.size() >= least) names.insert(name);
  catalogue.for_each({}, [&](const CatalogueEntry& other) {
    if (outputs.contains(other.name)) return;
    names.erase(other.patient);
    names.erase(other.patient_id);
  });
  return names;
}

/// The names as JSON has them, too, and without those that are found by a part of them.
std::set<std::string> searched(const std::set<std::string>& names) {
  std::set<std::string> all = names;
  for (const std::string& name : names) {
    const std::string text = nlohmann::json(text_of_name(name)).dump();
    all.insert(text.substr(1, text.size() - 2));
  }
  std::set<std::string> needed;
  for (const std::string& name : all)
    if (std::ranges::none_of(all, [&](const std::string& part) {
          return part.size() < name.size() && name.find(part) != name.npos;
        }))
      needed.insert(name);
  return needed;
}

bool has_any(std::string_view bytes, const std::set<std::string>& names) {
  return std::ranges::any_of(names, [&](const std::string& name) { return bytes.find(name) != bytes.npos; });
}

/// True if a file has one of the names, which JSON may have in another form.
bool file_has_any(const std::string& path, const std::set<std::string>& names) {
  constexpr std::size_t step = std::size_t{1} << 20;
  std::size_t longest = 0;
  for (const std::string& name : names) longest = std::max(longest, name.size());
  FileBytes file(path);
  std::string bytes;
  for (;;) {
    const std::size_t before = bytes.size();
    bytes.resize(before + step);
    const std::size_t count = file.read(reinterpret_cast<std::byte*>(bytes.data()) + before, step);
    bytes.resize(before + count);
    if (has_any(bytes, names)) return true;
    if (count == 0) return false;
    bytes.erase(0, bytes.size() - std::min(bytes.size(), longest));
  }
}

/// Searches a directory, and those below it.
void search(const std::string& folder, const std::set<std::string>& names, std::vector<std::string>& found) {
  std::vector<FolderEntry> entries;
  if (!files().list(folder, entries)) throw world_error("cannot read", folder, errno);
  for (const FolderEntry& entry : entries) {
    const std::string path = folder + "/" + entry.name;
    if (has_any(entry.name, names)) found.push_back(path);
    if (entry.type == FileType::folder)
      search(path, names, found);
    else if (entry.type == FileType::regular && !entry.name.ends_with(".tag") && file_has_any(path, names))
      found.push_back(path);
  }
}

}  // namespace

Forgotten forget(const Catalogue& catalogue, const std::vector<CatalogueEntry>& entries) {
  Forgotten forgotten;
  std::set<std::string> outputs;
  for (const CatalogueEntry& entry : entries) outputs.insert(entry.name);
  const std::set<std::string> names = searched(names_of(catalogue, entries, outputs));
  RecordsEditor records(catalogue.folder());
  for (const CatalogueEntry& entry : entries) remove_output(catalogue, entry, forgotten);
  forgotten.unknown = records.rewrite([&](nlohmann::ordered_json& json) {
    const bool stays = !outputs.contains(name_of_text(json["output"].get<std::string>()));
    if (!stays) ++forgotten.records;
    return stays;
  });
  // The index follows from what stays.
  const Catalogue updated(catalogue.folder(), 1);
  if (!names.empty()) search(catalogue.folder(), names, forgotten.found);
  return forgotten;
}

}  // namespace tagrid
