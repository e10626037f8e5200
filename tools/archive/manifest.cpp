#include "tools/archive/manifest.h"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/file_bytes.h"
#include "io/files/output_file.h"
#include "io/system/files.h"
#include "io/text/addresses.h"
#include "io/text/paths.h"
#include "io/text/text.h"
#include "tools/archive/late_syncs.h"
#include "tools/archive/name_template.h"
#include "tools/options/shared_options.h"
#include "tools/report/damage.h"
#include "tools/report/failure.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

constexpr const char* ending = ".tag";

bool goes_up(const fs::path& path) {
  return std::ranges::any_of(path, [](const fs::path& step) { return step == ".."; });
}

/// Such a directory would be mistaken for records, or would block their names.
void refuse_records(const std::string& given, const fs::path& output) {
  const std::string first = text_of(*output.begin());
  const bool is_of_lines = first.starts_with("results") || first.starts_with("events");
  if ((is_of_lines && first.ends_with(".jsonl")) || first.starts_with("archive.sqlite"))
    throw UsageError("{}: {} is a name for a file of records; choose another name for the directory", given,
                     first);
}

/// Calls use(folder) for every folder of `output` below `root`, the outermost first.
template <class Use>
void for_each_folder(const std::string& root, const std::string& output, Use use) {
  fs::path folder = path_of(root);
  for (const fs::path& step : path_of(output).parent_path()) use(text_of(folder /= step));
}

/// Returns true if the directory exists.
bool is_own_folder(const std::string& folder) {
  const auto status = status_of_name(folder);
  if (status && status->is_link())
    throw UsageError(
        folder +
        ": is a symbolic link, but outputs must stay inside the output directory; put a directory "
        "there, or choose another output");
  if (status && !status->is_folder())
    throw UsageError(folder + ": is not a directory; choose another output");
  return status.has_value();
}

constexpr std::size_t longest_line = std::size_t{1} << 16;
/// Some editors write this at the beginning of a file.
constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";

/// Windows takes names for the same if they differ only in case.
std::string name_to_compare(const fs::path& path) {
  return is_windows ? lower_case_of_unicode(text_of(path)) : text_of(path);
}

/// The outputs of a list so far. No two may be the same file, and none may be a directory of another.
class TakenOutputs {
 public:
  /// `advice` ends every message.
  explicit TakenOutputs(std::string advice) : advice_(std::move(advice)) {}

  /// Throws UsageError, which names the earlier line, if `output` and an earlier output cannot both exist.
  void take(const std::string& output, std::size_t line) {
    const fs::path name = path_of(output);
    const std::string compared = name_to_compare(name);
    if (const auto [file, is_new] = files_.emplace(compared, line); !is_new)
      throw UsageError("{} would also be the output of line {}; {}", output, file->second, advice_);
    if (const auto folder = folders_.find(compared); folder != folders_.end())
      throw UsageError("{} would also be a directory of the output of line {}; {}", output, folder->second,
                       advice_);
    for (fs::path folder = name.parent_path(); !folder.empty(); folder = folder.parent_path()) {
      if (const auto file = files_.find(name_to_compare(folder)); file != files_.end())
        throw UsageError("{} is impossible, because {} is the output of line {}, not a directory; {}", output,
                         text_of(folder), file->second, advice_);
      folders_.emplace(name_to_compare(folder), line);
    }
  }

 private:
  std::string advice_;
  std::map<std::string, std::size_t> files_, folders_;  ///< with their first lines
};

/// The same file under a name that does not depend on where the program was started. A link stays a link.
std::string absolute_name(const fs::path& path) {
  return text_of(real_path_if_known(absolute_path(path).parent_path()) / path.filename());
}

ManifestLine parse_line(const std::vector<std::string_view>& columns, const fs::path& folder,
                        const OptionTexts& given, bool keep_folders) {
  ManifestLine line;
  std::string listed(columns[0]);
  if (is_address(listed))
    throw UsageError("{}: is an address, and only .tag files are read from servers; download it first",
                     shown_address(listed));
  if (is_unknown_address(listed, folder)) throw UsageError(about_unknown_address(listed));
  while (listed.size() > 1 && listed.ends_with('/')) listed.pop_back();
  const fs::path path = path_of(path_in(text_of(folder), listed));
  if (path.filename().empty() || path.filename() == "." || path.filename() == "..")
    throw UsageError("{}: is not the name of a file or a directory", columns[0]);
  line.name = listed;
  line.input = absolute_name(path);
  line.is_relative = !is_absolute(path_of(listed));
  const bool looks_like_columns = columns.size() == 1 && columns[0].find(' ') < columns[0].rfind('=') &&
                                  columns[0].rfind('=') != columns[0].npos;
  if (looks_like_columns && !status_of_name(line.input))
    throw UsageError("{}: there is no such file; if these are columns, separate them by tabs, not by spaces",
                     columns[0]);
  line.options = given;
  std::set<std::string> names;
  for (std::size_t i = 1; i < columns.size(); ++i) {
    // Tables of spreadsheets end in empty columns.
    if (columns[i].empty()) continue;
    const std::size_t equals = columns[i].find('=');
    if (equals == 0 || equals >= columns[i].size() - 1)
      throw UsageError("{}: must be option=value", columns[i]);
    const std::string name(columns[i].substr(0, equals)), value(columns[i].substr(equals + 1));
    if (!names.insert(name).second) throw UsageError("{} is given twice", name);
    if (name == "output")
      line.output = output_called(value);
    else if (name == "mark")
      line.mark = value;
    else
      line.options[name] = value;
    if (name == "series" || name == "dataset") line.name += fmt::format(" ({}={})", name, value);
  }
  // A directory may have dots in its name.
  const bool has_suffix = !is_folder(text_of(path));
  if (line.output.empty())
    line.output = keep_folders ? output_mirroring(listed, !has_suffix)
                               : text_of(has_suffix ? path.stem() : path.filename()) + ".tag";
  return line;
}

}  // namespace

std::string output_called(const std::string& name) {
  const fs::path path = path_of(name);
  if (is_absolute(path)) throw UsageError("output={}: must be a path inside the output directory", name);
  if (goes_up(path)) throw UsageError("output={}: must not contain ..", name);
  fs::path output = normal_path(path);
  if (output.filename().empty() || output == ".")
    throw UsageError("output={}: is not the name of a file", name);
  if (output.extension() != path_of(ending)) output += ending;
  refuse_records("output=" + name, output);
  return text_of(output);
}

std::string mark_of_output(const std::string& output, const KeyFile& keys) {
  constexpr std::size_t digits = 16;
  return keys.hash({"output", output}, digits);
}

void require_keyed_output(const ManifestLine& line, const KeyFile& keys) {
  // Whoever writes an output himself may name a patient, and no program can tell.
  if (line.mark != mark_of_output(line.output, keys))
    throw UsageError(
        "line {}: its output does not have its name by {} (mark=), so it may be named after its input; make "
        "the "
        "list with --find ROOT --keys {}",
        line.number, keys.path(), word_of_command(keys.path()));
}

bool is_possible_output(const std::string& name) {
  if (name.empty() || name.find('\0') != name.npos) return false;
  try {
    return output_called(name) == name;
  } catch (const UsageError&) {
    return false;
  }
}

std::string output_mirroring(const std::string& listed, bool is_folder) {
  const fs::path path = path_of(listed);
  // ".." may lead through a link, so the name would not show the folder of the volume.
  if (is_absolute(path) || goes_up(path))
    throw UsageError(
        "{}: --keep-folders needs a relative path without ..; name its output in a column output=NAME",
        listed);
  const fs::path normal = normal_path(path);
  const fs::path output =
      normal.parent_path() / path_of((text_of(is_folder ? normal.filename() : normal.stem()) + ending));
  refuse_records(listed, output);
  return text_of(output);
}

void require_own_folders(const std::string& root, const std::string& output) {
  for_each_folder(root, output, is_own_folder);
}

void make_own_folders(const std::string& root, const std::string& output, LateSyncs* later) {
  for_each_folder(root, output, [later](const std::string& folder) {
    // Another process may create the directory at the same time. Either process makes it durable.
    if (!is_own_folder(folder) && !files().make_folder(folder) && errno != EEXIST)
      throw world_error("cannot create the directory", folder, errno);
    is_own_folder(folder);
    if (later != nullptr) return later->add(folder_of(folder));
    if (const int error = sync_folder(folder_of(folder)); error != 0)
      throw world_error("cannot sync its parent directory", folder, error);
  });
}

std::vector<ManifestLine> read_manifest(const std::string& path, const OptionTexts& given,
                                        bool keep_folders) {
  FileBytes file(path);
  // Relative paths cannot start at the directory of a pipe: the pipe of <(...) in a shell is in /dev.
  const bool in_folder = is_regular_output(path) && path != "/dev/stdin" && !path.starts_with("/dev/fd/") &&
                         !path.starts_with("/proc/");
  const fs::path folder = in_folder ? path_of(path).parent_path() : fs::path();
  std::vector<ManifestLine> lines;
  TakenOutputs taken(keep_folders
                         ? "give it another name in a column output=NAME"
                         : "give it another name in a column output=NAME; --keep-folders keeps volumes of "
                           "different directories apart");
  std::set<OptionTexts> seen;
  std::string text;
  for (std::size_t number = 1;; ++number, text.clear()) {
    try {
      if (!file.read_line(text, longest_line)) throw UsageError("is too long");
      if (text.empty()) break;
      if (number == 1 && text.starts_with(byte_order_mark)) text.erase(0, byte_order_mark.size());
      while (text.ends_with('\n') || text.ends_with('\r')) text.pop_back();
      if (text.find('\0') != text.npos) throw UsageError("contains a zero byte, so the list is not text");
      if (text.find_first_not_of(" \t") == text.npos || text.starts_with('#')) continue;
      ManifestLine line = parse_line(split(text, '\t'), folder, given, keep_folders);
      line.number = number;
      // Most lines have the same options.
      if (seen.insert(line.options).second) encoding_of(line.options);
      taken.take(line.output, number);
      lines.push_back(std::move(line));
    } catch (const UsageError& error) {
      throw UsageError("{}: line {}: {}", file.name(), number, words_of(error));
    }
  }
  return lines;
}

}  // namespace tagrid
