#include "tools/archive/found_lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>
#include <string_view>

#include "io/bytes/checksum.h"
#include "io/files/file_attributes.h"
#include "io/files/file_bytes.h"
#include "io/formats/table/other_formats.h"
#include "io/text/paths.h"
#include "io/text/text.h"
#include "tools/archive/manifest.h"
#include "tools/report/failure.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;
using Kind = FoundVolume::Kind;

/// Names of series and data sets come from files, which must not write lines of their own.
bool fits_a_line(const fs::path& path, const OptionTexts& options) {
  const auto fits = [](std::string_view text) {
    return text.find_first_of(std::string_view("\t\n\r\0", 4)) == text.npos;
  };
  return fits(text_of(path)) &&
         std::ranges::all_of(options, [&](const auto& option) { return fits(option.second); });
}

/// Two outputs whose names differ in .tag alone would be one file.
std::string file_of(const std::string& output) {
  return output.ends_with(".tag") ? output.substr(0, output.size() - 4) : output;
}

/// Eight hexadecimal digits for the path of a volume and the options that choose it.
std::string checksum_of_source(const std::string& relative, const OptionTexts& options) {
  std::string source = relative;
  for (const auto& [name, value] : options)
    if (name != "gaps-ok" && name != "data-outside") source += '\0' + name + '\0' + value;
  return fmt::format("{:016x}", checksum_of({std::as_bytes(std::span(source))})).substr(0, 8);
}

/// The place of an output: `relative`, the path of the file or directory of the volume, and below it the
/// series or data set that `options` choose. It depends on nothing else, and different volumes have different
/// ones. What a path cannot have, here or on Windows, is written as %2F.
std::string output_name_of(const std::string& relative, const OptionTexts& options) {
  fs::path name = relative == "." ? fs::path() : path_of(relative);
  if (const auto series = options.find("series"); series != options.end()) name /= step_of(series->second);
  if (const auto dataset = options.find("dataset"); dataset != options.end())
    // The path of a data set is one of directories, too.
    for (const fs::path& step : path_of(dataset->second).relative_path())
      if (!step.empty()) name /= step_of(text_of(step));
  if (const auto grid = options.find("vdb-grid"); grid != options.end()) name /= step_of(grid->second);
  return text_of(name);
}

/// What tells a volume from all others: for DICOM its series, wherever it lies, otherwise its path.
std::string identity_of(const std::string& path, const OptionTexts& options, const std::string& series) {
  const auto chosen = options.find("series");
  if (!series.empty() && chosen != options.end() && chosen->second.starts_with(series)) return chosen->second;
  std::string identity = series.empty() ? path : series;
  for (const auto& [name, value] : options)
    if (name != "gaps-ok" && name != "data-outside") identity += fmt::format("\t{}={}", name, value);
  return identity;
}

/// Extensions of files that often hold samples alone.
constexpr std::array samples_alone = {".raw", ".vol", ".bin", ".dat", ".img", ".rec"};

}  // namespace

bool is_directory_of_dicom(const fs::path& path) {
  return lower_case(text_of(path.filename())) == "dicomdir";
}

void FoundLines::give(const fs::path& path, const OptionTexts& options, const std::string& text,
                      const Subject& subject, const std::string& type, bool is_dicom) {
  ++volumes_;
  if (!fits_a_line(path, options))
    return use_(
        {text_of(path), options, "",
         text_of(path) +
             ": a name has a tab or a line end, which a list cannot have; rename it, or give this volume "
             "to tagrid encode",
         Kind::broken});
  if (names_ == nullptr) return use_({text_of(path), options, output_of(path, options), text});
  const fs::path place = is_directory_of_dicom(path) ? path.parent_path() : path;
  const std::string output =
      names_->name_of({.subject = subject,
                       .type = type,
                       .stem = text_of(is_folder(text_of(place)) ? place.filename() : place.stem()),
                       .identity = identity_of(text_of(path), options, is_dicom ? subject.series : "")});
  const auto [first, is_new] = named_.emplace(file_of(output), text_of(path));
  try {
    if (is_new && fits_a_line(path_of(output), {})) {
      output_called(output);
      return use_({text_of(path), options, output, text});
    }
    use_({text_of(path), options, "",
          is_new ? fmt::format("{}: --name gives it an impossible name", text_of(path))
                 : fmt::format("{}: --name gives it the name {}, which {} has; other fields tell them apart, "
                               "if they are no copies",
                               text_of(path), output, first->second),
          Kind::nameless});
  } catch (const UsageError& error) {
    use_({text_of(path), options, "", fmt::format("{}: {}", text_of(path), words_of(error)), Kind::nameless});
  }
}

void FoundLines::give_broken(const fs::path& path, const OptionTexts& options, const Error& error) {
  // An image that a DICOMDIR names is looked at again in its directory if it cannot be read.
  const std::string text = words_of(error);
  if (broken_.insert(text).second) use_({text_of(path), options, "", text, Kind::broken});
}

std::string FoundLines::output_of(const fs::path& path, const OptionTexts& options) {
  // The images of a DICOMDIR are those of its directory.
  const fs::path place = is_directory_of_dicom(path) ? path.parent_path() : path;
  std::string name = output_name_of(text_of(relative_path(place, root_)), options);
  if (name.empty()) name = text_of(root_.filename());
  if (taken_.insert(file_of(name)).second) return name;
  // A file may have the name of a series. The suffix depends on this volume alone: names must stay.
  name += "-" + checksum_of_source(text_of(relative_path(path, root_)), options);
  taken_.insert(file_of(name));
  return name;
}

void FoundLines::pass_over(const fs::path& file, const std::string& why) {
  passed_over_[{text_of(file.parent_path()), why}].push_back(text_of(file.filename()));
}

void FoundLines::belongs(const std::string& file) { of_volumes_.insert(text_of(real_path(path_of(file)))); }

void FoundLines::report_passed_over() const {
  constexpr std::size_t most_names = 5;
  for (const auto& [where, names] : passed_over_) {
    std::string listed;
    std::size_t count = 0;
    for (const std::string& name : names) {
      if (of_volumes_.contains(path_in(where.first, name))) continue;
      if (++count <= most_names) listed += fmt::format("{}{}", listed.empty() ? "" : ", ", name);
    }
    if (count == 0) continue;
    if (count > most_names) listed += fmt::format(" and {} more", count - most_names);
    use_({.path = "",
          .options = {},
          .output = "",
          .text = fmt::format("{}: {}: {}", text_of(relative_path(path_of(where.first), root_)), listed,
                              where.second),
          .kind = Kind::passed_over,
          .files = count});
  }
}

std::string why_no_volume(const std::string& path) {
  FileBytes file(path);
  const std::string_view beginning = file.peek(most_bytes_of_others);
  if (beginning.empty()) return "empty";
  if (const OtherFormat* other = other_format_of(beginning, path)) return std::string(other->what);
  const std::string extension = extension_of(path);
  if (std::ranges::find(samples_alone, extension) != samples_alone.end())
    return "perhaps samples without a header: a line needs the columns dims= and type=";
  return "no known format";
}

}  // namespace tagrid
