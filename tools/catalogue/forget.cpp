#include "tools/catalogue/forget.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <set>
#include <span>
#include <string_view>
#include <unordered_map>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/file_bytes.h"
#include "io/files/held_files.h"
#include "io/files/temporaries.h"
#include "io/parity/parity.h"
#include "io/system/files.h"
#include "io/text/paths.h"
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
  for (fs::path below = path_of(name).parent_path(); !below.empty(); below = below.parent_path()) {
    const std::string path = folder + "/" + text_of(below);
    if (!files().remove_folder(path)) return;
    sync_folder(folder_of(path));
  }
}

/// Throws UsageError if there is another file than the catalogue knows, or none that it could look at: it may be good.
void require_known(const Catalogue& catalogue, const CatalogueEntry& entry) {
  const std::string path = catalogue.path_of(entry.name);
  require_own_folders(catalogue.folder(), entry.name);
  if (catalogue.is_disputed(entry.name))
    throw UsageError(
        path +
        ": its header names another patient than the key file does; nothing was removed, find out "
        "which is right, and forget it by its name without --keys if it shall go");
  const auto status = status_of_name(path);
  const bool is_known = entry.bytes ? status && status->is_file() && status->size == *entry.bytes &&
                                          status->modified.in_nanoseconds() == entry.modified
                                    : !status;
  if (!is_known)
    throw UsageError(path +
                     ": has just changed, or cannot be looked at; nothing was removed, repeat the command");
}

/// Removes an output, its parity beside it, and what killed runs left of both.
void remove_output(const Catalogue& catalogue, const CatalogueEntry& entry, Forgotten& forgotten) {
  const std::string path = catalogue.path_of(entry.name), folder = folder_of(path);
  if (is_folder(folder)) {
    const OutputLock lock(path);
    require_known(catalogue, entry);
    remove_leftovers(folder, {path, parity_beside(path)});
    remove_if_there(parity_beside(path));
    if (remove_if_there(path)) {
      ++forgotten.outputs;
      forgotten.bytes += entry.bytes.value_or(0);
    }
    sync_folder(folder);
  }
  remove_empty_folders(catalogue.folder(), entry.name);
}

constexpr std::size_t least_letters = 4;  // shorter names are found anywhere

/// The names in an entry: of its patient, and of files and directories, unless they are mere numbers.
std::set<std::string> names_in(const CatalogueEntry& entry) {
  std::set<std::string> names = {entry.patient, entry.patient_id};
  const auto is_letter = [](unsigned char c) { return c >= 128 || std::isalpha(c) != 0; };
  for (const std::string& path : {entry.name, entry.input})
    for (const fs::path& step : path_of(path))
      if (std::ranges::any_of(text_of(step), is_letter)) names.insert(text_of(step));
  std::erase_if(names, [](const std::string& name) { return name.size() < least_letters; });
  return names;
}

/// Names that must not be found any more: those that no other volume has.
std::set<std::string> names_of(const Catalogue& catalogue, const std::vector<CatalogueEntry>& entries,
                               const std::set<std::string>& outputs) {
  std::set<std::string> names;
  for (const CatalogueEntry& entry : entries) names.merge(names_in(entry));
  catalogue.for_each({}, [&](const CatalogueEntry& other) {
    if (outputs.contains(other.name)) return;
    for (const std::string& name : names_in(other)) names.erase(name);
  });
  return names;
}

/// Finds any of many names in one pass over bytes: by their first letters.
class NameSearch {
 public:
  /// Names are also searched as JSON has them.
  explicit NameSearch(const std::set<std::string>& names) {
    for (const std::string& name : names) {
      const std::string text = nlohmann::json(text_of_name(name)).dump();
      for (const std::string& form : {name, text.substr(1, text.size() - 2)}) {
        by_beginning_[beginning_of(form.data())].push_back(form);
        longest_ = std::max(longest_, form.size());
      }
    }
  }
  bool is_needed() const { return longest_ > 0; }
  std::size_t longest() const { return longest_; }

  /// `is_all`: nothing follows these bytes. Otherwise, a name at their end may go on.
  bool finds_in(std::string_view bytes, bool is_all = true) const {
    for (std::size_t i = 0; i + least_letters <= bytes.size(); ++i)
      if (const auto found = by_beginning_.find(beginning_of(bytes.data() + i)); found != by_beginning_.end())
        for (const std::string& name : found->second)
          if (bytes.substr(i).starts_with(name) && is_whole(bytes, i, i + name.size(), is_all)) return true;
    return false;
  }

 private:
  /// CT 15 is not in CT 155, and P-4711 not in P-47112.
  static bool is_whole(std::string_view bytes, std::size_t begin, std::size_t end, bool is_all) {
    if (end == bytes.size() && !is_all) return false;
    const auto is_one_number = [&](std::size_t i) { return is_digit(bytes[i - 1]) && is_digit(bytes[i]); };
    return (begin == 0 || !is_one_number(begin)) && (end == bytes.size() || !is_one_number(end));
  }
  static std::uint32_t beginning_of(const char* text) {
    return load_little_endian<std::uint32_t>(reinterpret_cast<const std::byte*>(text));
  }

  std::unordered_map<std::uint32_t, std::vector<std::string>> by_beginning_;
  std::size_t longest_ = 0;
};

bool file_has_any(const std::string& path, const NameSearch& names) {
  constexpr std::size_t step = std::size_t{1} << 20;
  FileBytes file(path);
  std::string bytes;
  for (;;) {
    const std::size_t before = bytes.size();
    bytes.resize(before + step);
    const std::size_t count = file.read(reinterpret_cast<std::byte*>(bytes.data()) + before, step);
    bytes.resize(before + count);
    if (names.finds_in(bytes, count == 0)) return true;
    if (count == 0) return false;
    // With the byte before, which shows whether a number begins there.
    bytes.erase(0, bytes.size() - std::min(bytes.size(), names.longest() + 1));
  }
}

/// Searches a directory of an archive, and those below it. `outputs`: those that stay.
void search(const std::string& folder, const std::string& below, const NameSearch& names,
            const std::set<std::string>& outputs, std::vector<std::string>& found) {
  std::vector<FolderEntry> entries;
  if (!files().list(folder, entries)) throw world_error("cannot read", folder, errno);
  for (const FolderEntry& entry : entries) {
    const std::string path = folder + "/" + entry.name, name = below + entry.name;
    if (names.finds_in(entry.name)) found.push_back(path);
    if (entry.type == FileType::folder)
      search(path, name + "/", names, outputs, found);
    else if (entry.type == FileType::regular && !outputs.contains(name) && file_has_any(path, names))
      found.push_back(path);
  }
}

}  // namespace

Forgotten forget(const Catalogue& catalogue, const std::vector<CatalogueEntry>& entries,
                 RecordsEditor& records) {
  Forgotten forgotten;
  std::set<std::string> outputs;
  for (const CatalogueEntry& entry : entries) outputs.insert(entry.name);
  const NameSearch names(names_of(catalogue, entries, outputs));
  for (const CatalogueEntry& entry : entries) require_known(catalogue, entry);
  forgotten.unknown = records.prepare([&](nlohmann::ordered_json& json) {
    if (!outputs.contains(name_of_text(json["output"].get<std::string>()))) return Edit::keep;
    ++forgotten.records;
    return Edit::drop;
  });
  for (const CatalogueEntry& entry : entries) remove_output(catalogue, entry, forgotten);
  records.commit();
  std::set<std::string> others;
  {
    // The index follows from what stays. It is closed before it is searched.
    const Catalogue updated(catalogue.folder(), 1);
    updated.for_each({}, [&](const CatalogueEntry& other) { others.insert(other.name); });
  }
  if (names.is_needed()) search(catalogue.folder(), "", names, others, forgotten.found);
  return forgotten;
}

}  // namespace tagrid
