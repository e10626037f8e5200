#include "tools/archive/removed_originals.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <optional>
#include <utility>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/system/files.h"
#include "io/text/paths.h"
#include "tools/archive/manifest.h"
#include "tools/archive/records.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

/// The deepest directory that holds both, or is one of them; empty if they have different roots.
fs::path common_folder(fs::path one, const fs::path& other) {
  if (relative_path(other, one).empty()) return {};
  while (!is_below(other, one)) one = one.parent_path();
  return one;
}

fs::path common_folder(const std::vector<InputFile>& files) {
  fs::path folder = path_of(files.front().path).parent_path();
  for (const InputFile& file : files) folder = common_folder(folder, path_of(file.path).parent_path());
  return folder;
}

/// Why a record, which anybody may have changed, cannot be one of convert; "" if it can.
std::string impossible_name(const std::string& output, const KnownOutput& known) {
  if (!is_possible_output(output))
    return fmt::format("{}: is in a record, and is no name that convert gives to an output", output);
  if (known.input_files.empty()) return "its record names no files";
  for (const InputFile& file : known.input_files)
    if (file.path.empty() || file.path.find('\0') != file.path.npos)
      return "its record names impossible files";
  return "";
}

/// Adds the names of all .tag files in `below`, a directory in `root` or "" for itself, and in the directories below.
void add_tag_files(const std::string& root, const std::string& below, std::vector<std::string>& names) {
  const std::string folder = below.empty() ? root : path_in(root, below);
  std::vector<FolderEntry> entries;
  if (!files().list(folder, entries)) throw world_error("cannot read", folder, errno);
  for (const FolderEntry& entry : entries) {
    const std::string name = path_in(below, entry.name);
    if (entry.type == FileType::folder)
      add_tag_files(root, name, names);
    else if (entry.name.ends_with(".tag") && is_file(folder, entry))
      names.push_back(name);
  }
}

/// An unreadable record may be the only one that says that an original was removed.
std::vector<std::string> what_is_unknown(const std::string& output_dir, const KnownOutputs& known) {
  std::vector<std::string> sentences = known.unreadable();
  if (sentences.empty()) return sentences;
  std::vector<std::string> names;
  add_tag_files(output_dir, "", names);
  std::ranges::sort(names);
  for (const std::string& name : names) {
    const KnownOutput* one = known.find(name);
    if (one != nullptr && (one->state == archive::Record::removed || status_of_name(one->input))) continue;
    const std::string output = path_in(output_dir, name);
    sentences.push_back(
        fmt::format("{}: is in no record that says \"removed\"; if its original is missing, `tagrid restore "
                    "{} -o DIR` restores it",
                    output, output));
  }
  return sentences;
}

}  // namespace

std::string folder_of_all(const std::vector<RemovedOriginal>& originals) {
  std::optional<fs::path> all;
  for (const RemovedOriginal& original : originals) {
    if (original.folder.empty()) continue;
    const fs::path folder = path_of(original.folder);
    all = all ? common_folder(*all, folder) : folder;
  }
  return text_of(all.value_or(""));
}

RemovedOriginals removed_originals(const std::string& output_dir, KeyFile* keys) {
  const KnownOutputs known(output_dir, keys);
  if (known.files() == 0)
    throw BrokenInput(output_dir +
                      ": has no records of convert (results.jsonl); give the directory of its outputs");
  known.require_these_keys();
  std::vector<RemovedOriginal> originals;
  for (const auto& [output, one] : known.all()) {
    if (one.state != archive::Record::removed) continue;
    RemovedOriginal original{one.input, path_in(output_dir, output), "", false, ""};
    original.error = impossible_name(output, one);
    if (original.error.empty()) {
      original.folder = text_of(common_folder(one.input_files));
      original.is_back = std::ranges::all_of(
          one.input_files, [](const InputFile& file) { return is_file_of_size(file.path, file.bytes); });
    }
    originals.push_back(std::move(original));
  }
  return {std::move(originals), what_is_unknown(output_dir, known)};
}

}  // namespace tagrid
