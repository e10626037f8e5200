// tagrid-read-tiff: TIFF files, and directories of slices.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <exception>
#include <filesystem>
#include <memory>
#include <set>
#include <utility>

#include "io/errors/errors.h"
#include "io/formats/slices/slice_files.h"
#include "io/formats/tiff/reader/tiff_volumes.h"
#include "io/programs/serve_reader.h"
#include "io/programs/words.h"
#include "io/text/numbered_names.h"
#include "io/text/paths.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

/// What a directory holds: slices by the numbers in their names, or a file that is one volume or several by
/// itself, perhaps with others of its set.
struct Entry {
  std::string name;
  NumberedFiles slices;  ///< none for a file
  TiffVolumes volumes;
  std::exception_ptr broken;  ///< why the file cannot be read; thrown if it is chosen

  bool is_file() const { return slices.paths.empty(); }
};

const std::vector<std::string> extensions = {".tif", ".tiff"};

bool is_tiff(const std::string& path) {
  return std::ranges::find(extensions, extension_of(path)) != extensions.end();
}

class Folder {
 public:
  Folder(const std::string& folder, bool gaps_ok) : gaps_ok_(gaps_ok) {
    std::vector<NumberedFiles> series = series_of_slices(folder, extensions);
    for (std::size_t i = 0; i < series.size(); ++i) {
      NumberedFiles files = series[i];
      if (std::erase_if(files.paths, [&](const std::string& path) { return is_taken(path); }) > 0) {
        // What a set leaves has other steps between its numbers.
        std::vector<NumberedFiles> left = numbered_files(std::move(files.paths));
        series.insert(series.end(), left.begin(), left.end());
      } else {
        add(std::move(files));
      }
    }
  }

  std::vector<Entry> take() { return std::move(entries_); }

 private:
  void add(NumberedFiles files) {
    Entry first = entry_of(files.paths.front());
    if (files.paths.size() > 1 && !is_stack(first)) {
      entries_.push_back({files.pattern, std::move(files), {}, nullptr});
      return;
    }
    take_files(first);
    keep(std::move(first));
    for (std::size_t i = 1; i < files.paths.size(); ++i) {
      if (is_taken(files.paths[i])) continue;
      Entry other = entry_of(files.paths[i]);
      take_files(other);
      keep(std::move(other));
    }
  }

  /// Files of one set that is broken are broken for the same reason.
  void keep(Entry entry) {
    if (!entry.broken || reasons_.insert(reason_of(entry)).second) entries_.push_back(std::move(entry));
  }
  static std::string reason_of(const Entry& entry) {
    try {
      std::rethrow_exception(entry.broken);
    } catch (const Error& error) {
      return error.what();
    }
  }

  Entry entry_of(const std::string& path) const {
    Entry entry{name_of_path(path), {}, {}, nullptr};
    say_working();
    try {
      entry.volumes = volumes_of_file(path, gaps_ok_);
      entry.name = name_of_set(entry.volumes.files, entry.name);
    } catch (const Error&) {
      entry.broken = std::current_exception();
    }
    return entry;
  }

  /// The first TIFF file of a set names it, whatever else is in the directory.
  static std::string name_of_set(const std::vector<std::string>& paths, std::string name) {
    for (const std::string& path : paths)
      if (const std::string other = name_of_path(path); is_tiff(other) && comes_before(other, name))
        name = other;
    return name;
  }

  /// True if a file has several slices, or would have if all were there.
  static bool is_stack(const Entry& entry) {
    if (!entry.broken)
      return entry.volumes.list.size() > 1 || entry.volumes.list.front().planes.size() > 1 ||
             entry.volumes.files.size() > 1;
    try {
      std::rethrow_exception(entry.broken);
    } catch (const Error& error) {
      return error.detail().problem == Problem::slices_missing;
    }
  }

  void take_files(const Entry& entry) {
    for (const std::string& path : entry.volumes.files) taken_.insert(name_of_path(path));
  }
  bool is_taken(const std::string& path) const { return taken_.contains(name_of_path(path)); }

  bool gaps_ok_;
  std::set<std::string> taken_, reasons_;
  std::vector<Entry> entries_;
};

TiffVolumes volumes_of_slices(const std::string& folder, const NumberedFiles& files,
                              const ReaderOptions& options) {
  require_no_gap(folder, files, options);
  TiffVolumes volumes = volume_of_files(files.paths);
  volumes.pairs.push_back(pair_of(files));
  add_warning_of_gaps(folder, files, volumes.warnings);
  include_log(log_of_slices(folder, files), volumes.list.front().geometry, volumes.pairs, volumes.files,
              volumes.warnings);
  // If the log has the spacing, nobody needs one of the files.
  TiffVolume& volume = volumes.list.front();
  if (volume.geometry.has_spacing && !has_unknown_spacing(volume.geometry)) volume.remarks.warnings.clear();
  return volumes;
}

/// The volumes of an entry, for the user. Their names do not depend on other entries.
std::vector<Choice> choices_of(const Entry& entry) {
  if (!entry.is_file()) return {choice_of(entry.slices)};
  if (entry.broken) return {{entry.name, "cannot be read"}};
  std::vector<Choice> choices;
  for (const TiffVolume& volume : entry.volumes.list) {
    Choice choice = volume.choice;
    choice.name = choice.name.empty() ? entry.name : fmt::format("{}:{}", entry.name, choice.name);
    choices.push_back(std::move(choice));
  }
  return choices;
}

std::unique_ptr<ServedVolume> open_folder(const std::string& folder, const ReaderOptions& options) {
  std::vector<Entry> entries = Folder(folder, !option(options, "gaps-ok").empty()).take();
  std::vector<Choice> choices;
  std::vector<std::pair<std::size_t, std::size_t>> places;  // of each choice: its entry, and its number there
  for (std::size_t i = 0; i < entries.size(); ++i)
    for (Choice& choice : choices_of(entries[i])) {
      places.emplace_back(i, !places.empty() && places.back().first == i ? places.back().second + 1 : 0);
      choices.push_back(std::move(choice));
    }
  std::string wanted = option(options, "series");
  // Of the only file or set, the name within it is enough.
  if (const std::string whole = fmt::format("{}:{}", entries.front().name, wanted);
      entries.size() == 1 && std::ranges::count(choices, whole, &Choice::name) > 0)
    wanted = whole;
  const auto [which, number] = places[chosen(folder, "series", wanted, choices)];
  Entry& entry = entries[which];
  if (entry.broken) std::rethrow_exception(entry.broken);
  if (!entry.is_file()) entry.volumes = volumes_of_slices(folder, entry.slices, options);
  entry.volumes.name = folder;
  return slices_of(std::move(entry.volumes), number);
}

/// Opens a file, or a directory: of slices by the numbers in their names, of files that are volumes by
/// themselves, and of sets whose OME-XML names their files. Of several volumes, the option "series" chooses
/// one. Throws BrokenInput, UsageError, WorldError, SeveralVolumes.
std::unique_ptr<ServedVolume> open_tiff(const std::string& path, const ReaderOptions& options) {
  std::error_code unknown;
  if (fs::is_directory(path_of(path), unknown)) return open_folder(path, options);
  TiffVolumes volumes = volumes_of_file(path, !option(options, "gaps-ok").empty());
  volumes.name = path;
  std::vector<Choice> choices;
  for (const TiffVolume& volume : volumes.list) choices.push_back(volume.choice);
  const std::size_t number = chosen(path, "series", option(options, "series"), choices);
  return slices_of(std::move(volumes), number);
}

/// OME-XML names other files of its set, and may lie in a file of its own.
bool may_be_of_set(std::string_view own, std::string_view other) {
  constexpr std::array of_sets = {".tif", ".tiff", ".tf2", ".tf8", ".btf", ".ome", ".xml"};
  const std::string extension = extension_of(other);
  return std::ranges::find(of_sets, extension) != of_sets.end() ||
         (!extension.empty() && extension == extension_of(own));
}

}  // namespace
}  // namespace tagrid

int main() {
  return tagrid::serve_volumes("tiff", tagrid::open_tiff,
                               {.may_need = tagrid::may_be_of_set, .are_listed = true});
}
