#include "tools/archive/found_names.h"

#include <fmt/format.h>

#include <filesystem>
#include <string_view>

namespace tagrid {
namespace {

namespace fs = std::filesystem;

/// Characters that paths have no place for, or Windows and the servers of its shares have not.
constexpr std::string_view not_in_names = "/\\:*?\"<>|";

/// A text from a file as one step of a path.
std::string step_of(std::string_view text) {
  std::string step;
  for (const char c : text) {
    const bool is_plain = static_cast<unsigned char>(c) >= ' ' && c != '\x7f' && c != '%' &&
                          not_in_names.find(c) == not_in_names.npos;
    // Not a hidden file, and not the folder above.
    if (is_plain && !(c == '.' && step.empty()))
      step += c;
    else
      step += fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return step;
}

}  // namespace

std::string output_name_of(const std::string& relative, const OptionTexts& options) {
  fs::path name = relative == "." ? fs::path() : fs::path(relative);
  if (const auto series = options.find("series"); series != options.end()) name /= step_of(series->second);
  if (const auto dataset = options.find("dataset"); dataset != options.end())
    // The path of a data set is one of folders, too.
    for (const fs::path& step : fs::path(dataset->second).relative_path())
      if (!step.empty()) name /= step_of(step.string());
  if (const auto grid = options.find("vdb-grid"); grid != options.end()) name /= step_of(grid->second);
  return name.string();
}

}  // namespace tagrid
