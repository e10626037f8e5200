#include "io/samples/data_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <system_error>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/system/files.h"
#include "io/text/paths.h"
#include "io/text/text.h"
#include "io/volume/volume_info.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

/// The folders in which data may lie: that of the header as it is named, and as links lead to it.
std::vector<fs::path> folders_of(const std::string& header_path) {
  const fs::path header = path_of(header_path);
  const fs::path parent = header.parent_path();
  std::vector<fs::path> folders;
  if (const auto folder = without_links(parent.empty() ? path_of(".") : parent)) folders.push_back(*folder);
  if (const auto file = header_path == "-" ? std::nullopt : without_links(header))
    folders.push_back(file->parent_path());
  return folders;
}

/// The path of a data file, and where its samples are. If the path is next to the header, the file
/// can only be elsewhere because of a link.
std::string place_in_words(const std::string& path, const fs::path& file,
                           const std::vector<fs::path>& folders) {
  if (file == path_of(path)) return path;
  const auto parent = without_links(path_of(path).parent_path() / ".");
  const bool is_link =
      parent && std::ranges::any_of(folders, [&](const auto& folder) { return is_below(*parent, folder); });
  return is_link ? fmt::format("{}, which is a link to {}", path, text_of(file))
                 : fmt::format("{} ({})", path, text_of(file));
}

}  // namespace

bool is_on_server(std::string_view file) {
  const auto is_slash = [](char c) { return c == '/' || c == '\\'; };
  return file.size() > 1 && is_slash(file[0]) && (is_slash(file[1]) || file[1] == '?');
}

std::string path_of_data_file(const std::string& header_path, const std::string& data_file) {
  if (is_windows && is_on_server(data_file))
    throw BrokenInput("{}: its samples are in {}, on a server; copy the file to the directory of the header",
                      shown_input(header_path), printable(data_file));
  if (header_path == "-") return data_file;
  return path_in(text_of(path_of(header_path).parent_path()), data_file);
}

void require_inside(const std::string& header_path, const std::vector<std::string>& data_paths,
                    bool outside_ok, std::vector<std::string>& warnings) {
  const std::vector<fs::path> folders = folders_of(header_path);
  std::string first;
  std::size_t count = 0;
  for (const std::string& path : data_paths) {
    const auto file = without_links(path_of(path));
    // open_data_file() refuses what is not a regular file.
    if (!file || !is_regular_input(text_of(*file)) ||
        std::ranges::any_of(folders, [&](const auto& folder) { return is_below(*file, folder); }))
      continue;
    if (count++ == 0) first = place_in_words(path, *file, folders);
  }
  if (count == 0) return;
  const std::string text =
      fmt::format("{}: its samples are in {}, outside its directory", shown_input(header_path), first);
  if (!outside_ok) throw BrokenInput(text, Problem::data_outside);
  warnings.push_back(count == 1 ? text : fmt::format("{}, and in {} more such files", text, count - 1));
}

std::unique_ptr<FileBytes> open_data_file(const std::string& path, const std::string& data_file,
                                          const std::string& header_name, std::string_view format) {
  const auto status = status_of(path);
  // Opening reports missing files and directories.
  const bool is_plain = !status || status->is_file() || status->is_folder();
  if (data_file == "-" || !is_plain)
    throw BrokenInput("{}: {} header: data file: {}: must name a file, not a stream or a device", header_name,
                      format, tagrid::quoted(std::string_view(data_file)));
  try {
    return std::make_unique<FileBytes>(path);
  } catch (const WorldError& error) {
    throw WorldError("{}; it is the data file that {} names", error.what(), header_name);
  }
}

}  // namespace tagrid
