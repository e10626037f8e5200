#include "tools/archive/find_volumes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <map>
#include <set>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/file_bytes.h"
#include "io/formats/table/open_volume.h"
#include "io/metadata/region.h"
#include "io/system/files.h"
#include "io/text/numbered_names.h"
#include "io/text/paths.h"
#include "io/text/text.h"
#include "io/volume/one_of_volumes.h"
#include "tools/archive/found_lines.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

/// True if volumes of a file have no names, only numbers: they are alike.
bool are_numbered(const std::vector<Choice>& choices) {
  for (std::size_t i = 0; i < choices.size(); ++i)
    if (choices[i].name != std::to_string(i + 1)) return false;
  return true;
}

/// What distinguishes a DICOM series, as the choice lists it after the size: ", CT, EchoTime 2.46".
std::string told_by(const Choice& choice) {
  const std::size_t comma = choice.text.find(", ");
  return comma == std::string::npos ? "" : choice.text.substr(comma);
}

/// What a user should look at before the volume is converted: "; slices lie at unequal distances, ...".
const char* oddity_of(const VolumeInfo& info) {
  return info.metadata.text_of(slice_positions_key).empty()
             ? ""
             : "; slices are unequally spaced, or some are missing";
}

/// Files that can be slices, by the name of their format.
using Slices = std::map<std::string_view, std::vector<std::string>>;

class Finder {
 public:
  Finder(const std::string& root, const SourceOptions& accepted, const RunOptions& run,
         const NameTemplate* names, const SearchWatch& watch)
      : root_(real_path(path_of(root))),
        accepted_(accepted),
        run_(run),
        watch_(watch),
        lines_(root_, names, watch.found) {}

  void search_all() {
    search(root_);
    if (!run_.quiet) lines_.report_passed_over();
  }

 private:
  void search(const fs::path& folder) {
    const std::string place = text_of(folder);
    watch_.enter(place);
    const Format* whole = format_of_folder(place);
    if (whole != nullptr) {
      const std::size_t before = lines_.volumes();
      look_at_volume(folder, {}, *whole);
      if (lines_.volumes() > before) return;
    }
    std::vector<FolderEntry> entries;
    if (!tagrid::files().list(place, entries)) throw world_error("cannot read", place, errno);
    std::vector<std::string> files, folders;
    for (const FolderEntry& entry : entries) {
      if (entry.name.starts_with('.')) continue;
      const std::string path = path_in(place, entry.name);
      const bool is_link = entry.type == FileType::link, is_regular = is_file(place, entry);
      if (entry.type == FileType::folder)
        folders.push_back(path);
      else if (is_link && is_regular && is_found_itself(path_of(path)))
        lines_.pass_over(path_of(path), "a link to a file that is found at its own location");
      else if (is_regular)
        files.push_back(path);
      else
        lines_.pass_over(path_of(path),
                         is_folder(place, entry) ? "a link to a directory" : "not a file that can be read");
    }
    std::ranges::sort(files, comes_before);
    std::ranges::sort(folders, comes_before);
    if (whole != nullptr) return look_at_files_beside(folder, std::move(files));
    look_at_files(folder, files);
    for (const std::string& deeper : folders) {
      try {
        search(path_of(deeper));
      } catch (const WorldError& unreadable) {
        lines_.give_broken(path_of(deeper), {}, unreadable);
      }
    }
  }

  /// True if the search also meets the target of a link: if it is below the root and in no hidden directory.
  bool is_found_itself(const fs::path& link) const {
    const fs::path place = relative_path(real_path(link), root_);
    return !place.empty() &&
           std::ranges::none_of(place, [](const fs::path& step) { return text_of(step).starts_with('.'); });
  }

  /// A store without a volume may have its name, or its attributes, by chance. Its other files are its own.
  void look_at_files_beside(const fs::path& folder, std::vector<std::string> files) {
    std::erase_if(files, [](const std::string& file) {
      try {
        return readable_format(file) == nullptr;
      } catch (const Error&) {
        return false;
      }
    });
    look_at_files(folder, files, true);
  }

  /// With `is_store`, the directory also seems to be of another format than its slices are.
  void look_at_files(const fs::path& folder, const std::vector<std::string>& files, bool is_store = false) {
    Slices slices;
    for (const std::string& file : files) {
      try {
        const Format* format = readable_format(file);
        if (format == nullptr)
          lines_.pass_over(path_of(file), why_no_volume(file));
        else if (format->name == "dicom" && is_directory_of_dicom(path_of(file)))
          look_at_directory(file, *format);
        else if (format->reads.has_folders)
          slices[format->name].push_back(file);
        else if (!format->reads.program.empty() || !is_in_a_set(file))
          look_at_volume(path_of(file), {}, *format);
      } catch (const Error& error) {
        lines_.give_broken(path_of(file), {}, error);
      }
    }
    pass_over_previews(slices);
    for (const auto& [name, own] : slices)
      if (const Format& format = *read_format_named(name); format.reads.are_often_pictures)
        slices[name] = without_pictures(folder, format, slices);
    std::erase_if(slices, [](const auto& of_format) { return of_format.second.empty(); });
    for (const auto& [name, own] : slices) {
      OptionTexts options;
      if (slices.size() > 1 || is_store) options["from"] = name;
      look_at_slices(folder, own, options, *read_format_named(name));
    }
  }

  /// The slices of a format that are no pictures: those that are numbered, of one size, and not named as slices of
  /// another format are.
  std::vector<std::string> without_pictures(const fs::path& folder, const Format& format,
                                            const Slices& slices) {
    std::set<std::string> others;
    for (const auto& [name, files] : slices)
      if (!read_format_named(name)->reads.are_often_pictures)
        for (const std::string& file : files) others.insert(text_of(path_of(file).stem()));
    const auto has_other = [&](const std::string& path) {
      return others.contains(text_of(path_of(path).stem()));
    };
    std::vector<std::string> kept, single;
    for (const NumberedFiles& one : numbered_files(slices.at(format.name))) {
      const std::string why = std::ranges::all_of(one.paths, has_other)
                                  ? "pictures of slices of another format"
                              : one.paths.size() == 1               ? "a picture, or a single slice"
                              : !are_of_one_size(one.paths, format) ? "pictures of several sizes"
                                                                    : "";
      if (why.empty()) kept.insert(kept.end(), one.paths.begin(), one.paths.end());
      if (one.paths.size() == 1) single.push_back(one.paths.front());
      for (const std::string& path : one.paths)
        if (!why.empty()) lines_.pass_over(path_of(path), why);
    }
    // The names of slices may have several numbers.
    if (are_of_one_size(single, format)) warn_of_patterns(folder, numbered_files(single));
    return kept;
  }

  /// True if the files state one size, or cannot be read, which is reported when they are opened. Formats of pictures
  /// are recognized by first bytes that also have the size and the type of samples.
  static bool are_of_one_size(const std::vector<std::string>& paths, const Format& format) {
    std::set<std::string> sizes;
    try {
      for (const std::string& path : paths)
        sizes.emplace(FileBytes(path).peek(format.reads.bytes_to_recognize()));
    } catch (const Error&) {
      return true;
    }
    return sizes.size() < 2;
  }

  void pass_over_previews(Slices& slices) {
    const auto are_previews = [](const auto& of_format) {
      return std::ranges::all_of(of_format.second, is_preview);
    };
    if (std::ranges::all_of(slices, are_previews)) return;
    for (auto& [name, own] : slices)
      std::erase_if(own, [&](const std::string& file) {
        if (is_preview(file)) lines_.pass_over(path_of(file), "a preview");
        return is_preview(file);
      });
    std::erase_if(slices, [](const auto& of_format) { return of_format.second.empty(); });
  }

  /// The series of a DICOMDIR; its images are not looked at where they lie.
  void look_at_directory(const std::string& path, const Format& format) {
    std::set<std::string> images;
    images_ = &images;
    look_at_volume(path_of(path), {}, format);
    images_ = nullptr;
    listed_images_.merge(images);
  }

  bool is_listed(const std::string& image) const {
    return listed_images_.contains(text_of(real_path(path_of(image))));
  }

  void look_at_slices(const fs::path& folder, const std::vector<std::string>& files,
                      const OptionTexts& options, const Format& format) {
    // Only the files themselves say what is a series in DICOM.
    if (format.name == "dicom") {
      if (!std::ranges::all_of(files, [&](const std::string& file) { return is_listed(file); }))
        look_at_folder_of_dicom(folder, files, options, format);
      return;
    }
    std::vector<NumberedFiles> series = numbered_files(files);
    warn_of_patterns(folder, series);
    for (std::size_t i = 0; i < series.size(); ++i) {
      NumberedFiles one = series[i];
      if (std::erase_if(one.paths, [&](const std::string& path) { return is_in_a_set(path); }) > 0) {
        // Without the files of a set, steps between numbers differ.
        std::vector<NumberedFiles> left = numbered_files(std::move(one.paths));
        series.insert(series.end(), left.begin(), left.end());
      } else if (one.paths.size() == 1 || has_slices(one.paths.front())) {
        for (const std::string& path : one.paths)
          if (!is_in_a_set(path)) look_at_volume(path_of(path), {}, format);
      } else {
        OptionTexts own = options;
        own["series"] = one.pattern;
        look_at_volume(folder, own, format);
      }
    }
  }

  void warn_of_patterns(const fs::path& folder, const std::vector<NumberedFiles>& series) const {
    std::vector<std::string> patterns;
    for (const NumberedFiles& one : series)
      patterns.push_back(one.paths.size() == 1 ? name_of_path(one.paths.front()) : one.pattern);
    if (const std::string doubt = doubt_of_patterns(patterns); !doubt.empty())
      warn(run_, "{}: {}", text_of(folder), doubt);
  }

  /// True for a file of a volume that was listed by the name of another one of its files.
  bool is_in_a_set(const std::string& path) const { return files_of_sets_.contains(path); }

  /// Files that no series has are passed over.
  void look_at_folder_of_dicom(const fs::path& folder, const std::vector<std::string>& files,
                               const OptionTexts& options, const Format& format) {
    std::set<std::string> used;
    used_images_ = &used;
    const std::size_t broken = lines_.broken();
    look_at_volume(folder, options, format);
    used_images_ = nullptr;
    for (const std::string& file : files)
      if (!used.contains(name_of_path(file)) && !is_listed(file))
        lines_.pass_over(path_of(file), lines_.broken() > broken
                                            ? "DICOM of a series that is not listed, or without an image"
                                            : "DICOM without an image, or an image that cannot be read");
  }

  /// True if the file has several slices, so that it is a volume of its own.
  bool has_slices(const std::string& path) const {
    try {
      return open_volume(path, run_.limited({}))->info().dims.z > 1;
    } catch (const UsageError& error) {
      return !error.detail().choices.empty();  // several volumes
    } catch (const BrokenInput& error) {
      return error.detail().problem == Problem::slices_missing;
    } catch (const Error&) {
      return false;
    }
  }

  /// If the path holds several volumes, each of them.
  /// `details` are those of the choice that the options make.
  void look_at_volume(const fs::path& path, OptionTexts options, const Format& format,
                      const std::string& details = "") {
    try {
      const auto volume = open_volume(text_of(path), encoding_of(options, run_).source);
      if (note_files(*volume, format) || is_of_a_listed_set(text_of(path), *volume)) return;
      const VolumeInfo& info = volume->info();
      if (const std::string& name = volume->facts().lasting_name; !name.empty())
        options.emplace("series", name);  // another one may come into the directory
      std::string text =
          fmt::format("{}, {}{}{}", described(info_of_volume(volume->facts(), 0).dims, info.type),
                      format.help, details, oddity_of(info));
      if (info.volumes > 1) text = fmt::format("{} volumes of {}", info.volumes, text);
      if (format.name == "dicom") text += about_other_folder(path, info);
      // What is missing from the volume, although it may be; or which files it names.
      if (options.contains("gaps-ok") || options.contains("data-outside"))
        for (const std::string& warning : all_warnings(volume->facts())) text += "; " + warning;
      lines_.give(path, options, text, subject_of(info.metadata), std::string(name_of(info.type)),
                  format.name == "dicom");
    } catch (const UsageError& error) {
      const std::vector<Choice>& choices = error.detail().choices;
      const std::string option = error.detail().option;
      if (choices.empty() || options.contains(option)) return lines_.give_broken(path, options, error);
      if (are_numbered(choices)) return look_at_numbered(path, option, choices.size(), format);
      for (const Choice& choice : choices) {
        OptionTexts own = options;
        own[option] = choice.name;
        look_at_volume(path, own, format, format.name == "dicom" ? told_by(choice) : "");
      }
    } catch (const BrokenInput& error) {
      const std::string accepted = option_that_accepts(error.detail().problem);
      if (accepted.empty() || options.contains(accepted)) return lines_.give_broken(path, options, error);
      options[accepted] = "true";
      look_at_volume(path, options, format, details);
    } catch (const Error& error) {
      lines_.give_broken(path, options, error);
    }
  }

  /// The option, among those that were given, with which this is no error; "" if there is none.
  std::string option_that_accepts(Problem problem) const {
    if (problem == Problem::slices_missing && accepted_.gaps_ok) return "gaps-ok";
    return problem == Problem::data_outside && accepted_.data_outside ? "data-outside" : "";
  }

  /// Notes the files of a volume that was found by the name of a file. True if they belong to a set that is
  /// already listed, so that `path` only refers to it.
  bool is_of_a_listed_set(const std::string& path, const VolumeSource& volume) {
    const std::vector<std::string>& files = volume.files();
    if (files.size() < 2 || is_folder(path)) return false;
    const bool is_own = std::ranges::find(files, path) != files.end();
    if (!is_own && std::ranges::all_of(files, [&](const std::string& file) { return is_in_a_set(file); })) {
      lines_.pass_over(path_of(path), "refers to a listed set of files, but is not one of them");
      return true;
    }
    files_of_sets_.insert(files.begin(), files.end());
    return false;
  }

  /// Says that a series has images in a directory that came before.
  std::string about_other_folder(const fs::path& path, const VolumeInfo& info) {
    const std::string uid = info.metadata.text_of("dicom_SeriesInstanceUID"),
                      folder = text_of(relative_path(path, root_));
    if (uid.empty()) return "";
    const auto& [known, is_new] = folders_of_series_.emplace(uid, folder);
    if (is_new || known->second == folder) return "";
    return fmt::format(
        "; {} also has images of this series: copies, or parts of one volume, which must then be in one "
        "directory",
        known->second);
  }

  /// Volumes of one file, all of one size: opening each would take long where the file is compressed.
  void look_at_numbered(const fs::path& path, const std::string& option, std::size_t count,
                        const Format& format) {
    const bool may_be_short = path.extension() != ".gz";
    std::string text, type;
    Subject subject;
    try {
      for (const std::size_t number : {std::size_t{1}, may_be_short ? count : 1}) {
        const auto volume =
            open_volume(text_of(path), encoding_of({{option, std::to_string(number)}}, run_).source);
        note_files(*volume, format);
        text = fmt::format("{}, {}", described(volume->info().dims, volume->info().type), format.help);
        type = name_of(volume->info().type);
        subject = subject_of(volume->info().metadata);
      }
    } catch (const Error& error) {
      return lines_.give_broken(path, {}, error);
    }
    for (std::size_t number = 1; number <= count; ++number)
      lines_.give(path, {{option, std::to_string(number)}},
                  fmt::format("{}, volume {} of {}", text, number, count), subject, type,
                  format.name == "dicom");
  }

  /// Notes the files of a volume. Returns true if a DICOMDIR has listed it.
  bool note_files(const VolumeSource& volume, const Format& format) {
    const std::vector<std::string>& files = volume.files();
    if (format.name == "dicom") {
      if (used_images_ != nullptr)
        for (const std::string& file : files) used_images_->insert(name_of_path(file));
      if (images_ == nullptr)
        return std::ranges::all_of(files, [&](const std::string& file) { return is_listed(file); });
      for (const std::string& file : files) images_->insert(text_of(real_path(path_of(file))));
      return false;
    }
    // Slices were recognised; logs and samples beside headers were not.
    for (const std::string& file : files) {
      const std::string extension = extension_of(file);
      const bool is_slice = std::ranges::find(format.extensions, extension) != format.extensions.end();
      if (!is_slice) lines_.belongs(file);
    }
    return false;
  }

  fs::path root_;
  SourceOptions accepted_;
  const RunOptions& run_;
  const SearchWatch& watch_;
  FoundLines lines_;
  std::map<std::string, std::string> folders_of_series_;  // the first one of each series of DICOM
  std::set<std::string> files_of_sets_;                   // that are volumes together
  std::set<std::string> listed_images_;                   // those of all DICOMDIRs
  std::set<std::string>* images_ = nullptr;               // those of the DICOMDIR that is being looked at
  std::set<std::string>* used_images_ =
      nullptr;  // names of those in series of the directory that is being looked at
};

}  // namespace

void find_volumes(const std::string& root, const SourceOptions& accepted, const RunOptions& run,
                  const NameTemplate* names, const SearchWatch& watch) {
  if (status_of(root) && !is_folder(root))
    throw UsageError(root + ": is a file; --find takes a directory; tagrid encode takes a file");
  if (!is_folder(root)) throw world_error("cannot read", root, ENOENT);
  Finder(root, accepted, run, names, watch).search_all();
}

}  // namespace tagrid
