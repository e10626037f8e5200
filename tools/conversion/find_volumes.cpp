#include "tools/conversion/find_volumes.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "io/files/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/natural_order.h"
#include "io/files/numbered_names.h"
#include "io/files/system_call.h"
#include "io/formats/open_volume.h"
#include "tools/report/advice.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

/// The option with which one of several volumes is chosen.
std::string option_of(const UsageError& error) {
  for (const Term& term : error.detail().sentence.terms)
    if (!term.setting.empty()) return term.setting;
  return "series";
}

class Finder {
 public:
  Finder(const std::string& root, const std::function<void(const FoundVolume&)>& use)
      : root_(fs::canonical(root)), use_(use) {}

  void search(const fs::path& folder) {
    std::vector<std::string> files, folders;
    std::error_code error;
    for (fs::directory_iterator entry(folder, error); !error && entry != fs::directory_iterator();
         entry.increment(error)) {
      std::error_code unknown;
      if (entry->path().filename().string().starts_with('.')) continue;
      if (entry->is_directory(unknown) && !entry->is_symlink(unknown))
        folders.push_back(entry->path());
      else if (entry->is_regular_file(unknown))
        files.push_back(entry->path());
    }
    if (error) throw world_error("cannot read", folder.string(), error.value());
    std::ranges::sort(files, comes_before);
    std::ranges::sort(folders, comes_before);
    look_at_files(folder, files);
    for (const std::string& deeper : folders) search(deeper);
  }

  fs::path root() const { return root_; }

 private:
  void look_at_files(const fs::path& folder, const std::vector<std::string>& files) {
    std::map<std::string_view, std::vector<std::string>> slices;  // by the name of their format
    for (const std::string& file : files) {
      const Format* format = nullptr;
      try {
        format = readable_format(file);
      } catch (const Error& error) {
        give({file, {}, "", words_of(error), true});
      }
      if (format == nullptr) continue;
      if (format->has_folders)
        slices[format->name].push_back(file);
      else
        look_at_volume(file, {}, *format);
    }
    const auto are_previews = [](const auto& of_format) {
      return std::ranges::all_of(of_format.second, is_preview);
    };
    if (!std::ranges::all_of(slices, are_previews))
      for (auto& [name, own] : slices) std::erase_if(own, is_preview);
    std::erase_if(slices, [](const auto& of_format) { return of_format.second.empty(); });
    for (const auto& [name, own] : slices) {
      OptionTexts options;
      if (slices.size() > 1) options["from"] = name;
      look_at_slices(folder, own, options, *read_format_named(name));
    }
  }

  void look_at_slices(const fs::path& folder, const std::vector<std::string>& files,
                      const OptionTexts& options, const Format& format) {
    // Only the files themselves say what is a series in DICOM.
    if (format.name == "dicom") return look_at_volume(folder, options, format);
    const std::vector<NumberedFiles> series = numbered_files(files);
    for (const NumberedFiles& one : series) {
      if (one.paths.size() == 1 || has_slices(one.paths.front())) {
        for (const std::string& path : one.paths) look_at_volume(path, {}, format);
        continue;
      }
      OptionTexts own = options;
      if (series.size() > 1) own["series"] = one.pattern;
      look_at_volume(folder, own, format);
    }
  }

  /// True if the file has several slices, so that it is a volume of its own.
  static bool has_slices(const std::string& path) {
    try {
      return open_volume(path)->info().dims.z > 1;
    } catch (const UsageError& error) {
      return !error.detail().choices.empty();  // several volumes
    } catch (const Error&) {
      return false;
    }
  }

  /// If the path holds several volumes, each of them.
  void look_at_volume(const fs::path& path, const OptionTexts& options, const Format& format) {
    try {
      const VolumeInfo info = open_volume(path, encoding_of(options).source)->info();
      give({path, options, "", fmt::format("{}, {}", described(info.dims, info.type), format.help)});
    } catch (const UsageError& error) {
      if (error.detail().choices.empty() || options.contains("series") || options.contains("dataset"))
        return give({path, options, "", words_of(error), true});
      for (const Choice& choice : error.detail().choices) {
        OptionTexts own = options;
        own[option_of(error)] = choice.name;
        look_at_volume(path, own, format);
      }
    } catch (const Error& error) {
      give({path, options, "", words_of(error), true});
    }
  }

  void give(FoundVolume volume) {
    // Names of series and data sets come from files, which must not write lines of their own.
    bool fits_a_line = volume.path.find_first_of("\t\n\r") == volume.path.npos;
    for (const auto& [name, value] : volume.options)
      fits_a_line =
          fits_a_line && value.find_first_of("\t\n\r") == value.npos && value.find('\0') == value.npos;
    if (!fits_a_line) {
      volume.text = volume.path + ": a name has a tab or a line end, which a list cannot have";
      volume.is_broken = true;
    }
    if (!volume.is_broken) volume.output = output_of(volume);
    use_(volume);
  }

  /// "2019/knee" for 2019/knee.nrrd; longer if that is taken.
  std::string output_of(const FoundVolume& volume) {
    const fs::path relative = fs::path(volume.path).lexically_relative(root_);
    const bool has_suffix = !is_folder(volume.path);
    fs::path name = has_suffix ? relative.parent_path() / relative.stem() : relative;
    if (name == ".") name = root_.filename();
    for (const char* option : {"series", "dataset"})
      if (const auto found = volume.options.find(option); found != volume.options.end()) {
        std::string part = found->second;
        std::ranges::replace(part, '/', '_');
        part.erase(0, part.find_first_not_of("._"));
        name /= part.empty() ? "volume" : part;
      }
    if (taken_.insert(name.string()).second) return name;
    if (has_suffix && taken_.insert(relative.string()).second) return relative;
    for (int i = 2;; ++i)
      if (const std::string other = fmt::format("{}-{}", name.string(), i); taken_.insert(other).second)
        return other;
  }

  fs::path root_;
  const std::function<void(const FoundVolume&)>& use_;
  std::set<std::string> taken_;
};

}  // namespace

void find_volumes(const std::string& root, const std::function<void(const FoundVolume&)>& use) {
  if (!is_folder(root)) throw world_error("cannot read", root, status_of(root) ? ENOTDIR : ENOENT);
  Finder finder(root, use);
  finder.search(finder.root());
}

}  // namespace tagrid
