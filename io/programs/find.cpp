#include "io/programs/find.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "io/errors/errors.h"
#include "io/system/files.h"
#include "io/system/processes.h"
#include "io/system/this_process.h"
#include "io/text/paths.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view reader_prefix = "tagrid-read-", writer_prefix = "tagrid-write-";

bool is_format_name(std::string_view name) {
  return !name.empty() && std::ranges::all_of(name, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-';
  });
}

bool is_program(const std::string& path) {
  const auto status = status_of(path);
  if (!status || !status->is_file() || !files().is_executable(path)) return false;
  constexpr unsigned by_all = 0002;
  if ((status->mode & by_all) != 0)
    throw WorldError(
        path + ": is not started, because any user can change it; take that permission away (chmod o-w)");
  return true;
}

std::optional<std::string> find(std::string_view prefix, std::string_view name) {
  if (!is_format_name(name)) return std::nullopt;
  for (const std::string& folder : program_folders())
    if (std::string path = path_in(folder, prefix).append(name).append(end_of_program_names());
        is_program(path))
      return path;
  return std::nullopt;
}

std::vector<FoundProgram> all(std::string_view prefix) {
  std::map<std::string, std::string> found;
  for (const std::string& folder : program_folders()) {
    std::vector<FolderEntry> entries;
    files().list(folder, entries);
    for (const FolderEntry& entry : entries) {
      if (!entry.name.starts_with(prefix) || !entry.name.ends_with(end_of_program_names())) continue;
      const std::string path = path_in(folder, entry.name);
      std::string name = entry.name.substr(prefix.size());
      name.resize(name.size() - std::min(name.size(), end_of_program_names().size()));
      if (is_format_name(name) && !found.contains(name) && is_program(path)) found.emplace(name, path);
    }
  }
  std::vector<FoundProgram> programs;
  for (const auto& [name, path] : found) programs.push_back({name, path});
  return programs;
}

}  // namespace

std::vector<std::string> program_folders() {
  std::vector<std::string> folders;
  constexpr std::string_view name = "TAGRID_READER_PATH=";
  for (const std::string& variable : environment()) {
    if (!variable.starts_with(name)) continue;
    for (const std::string_view folder :
         split(std::string_view(variable).substr(name.size()), separator_of_folders()))
      // Otherwise the current folder, which may belong to anybody, would choose programs.
      if (is_absolute(path_of(folder))) folders.emplace_back(folder);
  }
  if (const auto program = program_path()) {
    folders.push_back(text_of(program->parent_path()));
    folders.push_back(text_of(program->parent_path().parent_path() / "libexec/tagrid"));
  }
  return folders;
}

std::optional<std::string> find_reader(std::string_view name) { return find(reader_prefix, name); }
std::optional<std::string> find_writer(std::string_view name) { return find(writer_prefix, name); }

std::string_view package_of_program(std::string_view name) {
  return name == "vdb" ? "tagrid-openvdb" : "tagrid-readers";
}

std::string about_missing_program(std::string_view name) {
  std::string advice = fmt::format("install the package {}", package_of_program(name));
  // Somebody built the program alone.
  if (const auto program = program_path();
      program && is_file(text_of(program->parent_path() / "CMakeCache.txt")))
    advice = fmt::format("run cmake in {} to build all of it", text_of(program->parent_path()));
  const std::vector<std::string> folders = program_folders();
  const std::string places = folders.empty() ? "no directory" : fmt::format("{}", fmt::join(folders, ", "));
  return fmt::format("(looked for in {}); {}", places, advice);
}

std::string writer_for(const std::string& path, std::string_view format, std::string_view name) {
  if (auto program = find_writer(name)) return *program;
  throw WorldError("{}: {} is written by the program tagrid-write-{}, which is not installed {}",
                   shown_output(path), format, name, about_missing_program(name));
}

std::vector<FoundProgram> all_readers() { return all(reader_prefix); }
std::vector<FoundProgram> all_writers() { return all(writer_prefix); }

}  // namespace tagrid
