#include "io/files/slice_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <filesystem>

#include "io/errors/errors.h"
#include "io/system/files.h"
#include "io/text/numbered_names.h"
#include "io/text/paths.h"

namespace tagrid {

std::vector<std::string> visible_files(const std::string& folder) {
  std::vector<FolderEntry> entries;
  if (!files().list(folder, entries)) throw world_error("cannot read", folder, errno);
  std::vector<std::string> paths;
  for (const FolderEntry& entry : entries) {
    const std::string path = path_in(folder, entry.name);
    FileStatus status;
    const bool may_be_file =
        entry.type == FileType::regular ||
        (entry.type == FileType::link && (!files().status(path, true, status) || status.is_file()));
    if (may_be_file && !entry.name.starts_with('.')) paths.push_back(path);
  }
  std::ranges::sort(paths, comes_before);
  return paths;
}

std::string FilePattern::name(std::int64_t number) const {
  return zeros ? fmt::format("{}{:0{}}{}", before, number, width, after)
               : fmt::format("{}{:{}}{}", before, number, width, after);
}

std::vector<std::string> FilePattern::names(std::int64_t first, std::int64_t last, std::int64_t step,
                                            std::int64_t most) const {
  constexpr std::int64_t largest = std::int64_t{1} << 40;
  for (const std::int64_t number : {first, last, step})
    if (number < -largest || number > largest) throw BrokenInput("a number is too large");
  if (step == 0 || (last - first) / step < 0)
    throw BrokenInput("the step does not lead from the first number to the last");
  if ((last - first) / step >= most) throw BrokenInput("more than {} files", most);
  std::vector<std::string> names;
  for (std::int64_t i = 0; i <= (last - first) / step; ++i) names.push_back(name(first + i * step));
  return names;
}

std::optional<FilePattern> file_pattern(std::string_view name) {
  const std::size_t percent = name.find('%');
  if (percent == name.npos) return std::nullopt;
  const std::size_t end = std::min(name.find_first_not_of("0123456789", percent + 1), name.size());
  if (end == name.size() || (name[end] != 'd' && name[end] != 'i' && name[end] != 'u')) return std::nullopt;
  const std::string_view width = name.substr(percent + 1, end - percent - 1);
  if (width.size() > 3) throw BrokenInput("a number of so many digits is not supported");
  FilePattern pattern{std::string(name.substr(0, percent)), std::string(name.substr(end + 1))};
  pattern.zeros = width.starts_with('0');
  std::from_chars(width.data(), width.data() + width.size(), pattern.width);
  return pattern;
}

}  // namespace tagrid
