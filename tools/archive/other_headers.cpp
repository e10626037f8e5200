#include "tools/archive/other_headers.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <filesystem>
#include <set>
#include <string_view>
#include <utility>

#include "io/files/file_bytes.h"
#include "io/files/system_call.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view hdf5_signature = "\x89HDF\r\n\x1a\n";

std::string lower(std::string text) {
  std::ranges::transform(text, text.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

bool is_header_name(const fs::path& path) {
  constexpr std::array<std::string_view, 28> endings = {
      ".nhdr", ".nrrd", ".mhd",  ".mha", ".hdr",  ".vgi", ".vgl",    ".vrt",  ".xtekct", ".xtekvolume",
      ".xml",  ".xmf",  ".xdmf", ".vti", ".pvti", ".pvd", ".vtkhdf", ".json", ".h5",     ".hdf5",
      ".hdf",  ".he5",  ".nxs",  ".nx5", ".cxi",  ".nc",  ".dat",    ".pcr"};
  return std::ranges::count(endings, lower(path.extension().string())) > 0;
}

/// The beginning of a file, as far as it may name others. Only HDF5 has names among binary data. Throws WorldError: nobody
/// knows what a header names that cannot be read.
std::string text_of_header(const std::string& path) {
  constexpr std::size_t most_of_text = std::size_t{1} << 16, most_of_hdf5 = std::size_t{1} << 20;
  FileBytes file(path);
  std::string text(file.peek(hdf5_signature.size()));
  const bool is_hdf5 = text == hdf5_signature;
  text.resize(is_hdf5 ? most_of_hdf5 : most_of_text);
  text.resize(file.read(reinterpret_cast<std::byte*>(text.data()), text.size()));
  // Samples follow the header of NRRD after an empty line, and that of MetaImage after the word LOCAL.
  if (!is_hdf5)
    text.resize(std::min({text.size(), text.find("\n\n"), text.find("= LOCAL"), text.find('\0')}));
  return text;
}

/// A report of this program is about volumes, and is not needed to read one.
bool is_report(const fs::path& path, std::string_view text) {
  return lower(path.extension().string()) == ".json" && text.find("\"command\"") != text.npos &&
         text.find("\"bytes_out\"") != text.npos;
}

/// The last step of a path, with slashes of any system.
std::string_view last_step(std::string_view path) {
  const std::size_t slash = path.find_last_of("/\\");
  return slash == path.npos ? path : path.substr(slash + 1);
}

/// Calls use(name) for everything in the text that may be the name of a file: between delimiters, the value of a line,
/// and words.
template <class Use>
void for_each_possible_name(std::string_view text, Use use) {
  const auto try_all = [&](std::string_view part, std::string_view delimiters) {
    while (!part.empty()) {
      const std::size_t end = std::min(part.find_first_of(delimiters), part.size());
      if (const auto name = last_step(trimmed(part.substr(0, end))); !name.empty()) use(name);
      part.remove_prefix(std::min(end + 1, part.size()));
    }
  };
  std::string control;  // ends of lines, and what surrounds strings in binary files
  for (int c = 0; c < 32; ++c) control += static_cast<char>(c);
  try_all(text, control);
  try_all(text, control + "\"'<>");
  try_all(text, control + "=:");
  try_all(text, control + "\"'<>=:,;()[]{} ");
}

/// True if `pattern` is one of numbered files, as slice%03d.raw, and `name` is one of these.
bool is_numbered_as(std::string_view pattern, std::string_view name) {
  const std::size_t percent = pattern.find('%');
  if (percent == pattern.npos) return false;
  const std::size_t end = pattern.find_first_not_of("0123456789", percent + 1);
  if (end == pattern.npos || pattern[end] != 'd') return false;
  const std::string_view before = pattern.substr(0, percent), after = pattern.substr(end + 1);
  if (name.size() <= before.size() + after.size() || !name.starts_with(before) || !name.ends_with(after))
    return false;
  const auto digits = name.substr(before.size(), name.size() - before.size() - after.size());
  return digits.find_first_not_of("0123456789") == digits.npos;
}

/// Calls use(name) for the data files that a header of Analyze, NIfTI or ENVI has without naming them.
template <class Use>
void for_each_pair(const fs::path& header, Use use) {
  if (lower(header.extension().string()) != ".hdr") return;
  for (const char* of_data :
       {".img", ".IMG", ".img.gz", ".raw", ".RAW", ".dat", ".DAT", ".bil", ".bsq", ".bip", ".bin", ""})
    use(header.stem().string() + of_data);
}

std::string real_folder_of(const std::string& file) {
  std::error_code error;
  const fs::path folder = fs::weakly_canonical(folder_of(file), error);
  return error ? folder_of(file) : folder.string();
}

std::string file_name(const std::string& file) { return fs::path(file).filename().string(); }

}  // namespace

std::string not_own_name(const std::string& input, const std::string& file) {
  const std::string name = file_name(file), header = file_name(input);
  if (name == header) return "";
  // volume.ome.tif has volume.raw, too.
  for (std::string stem = fs::path(header).stem().string();; stem = fs::path(stem).stem().string()) {
    if (name.starts_with(stem)) {
      std::string_view rest = std::string_view(name).substr(stem.size());
      if (!rest.empty() && (rest.front() == '_' || rest.front() == '-')) rest.remove_prefix(1);
      rest.remove_prefix(std::min(rest.find_first_not_of("0123456789"), rest.size()));
      if (rest.empty() || rest.front() == '.') return "";
    }
    if (fs::path(stem).extension().empty()) break;
  }
  return "it lies beside " + header + ", whose name it does not have, so it may be of other volumes, too";
}

const OtherHeaders::Headers& OtherHeaders::in_folder(const std::string& folder) {
  if (const auto read = folders_.find(folder); read != folders_.end()) return read->second;
  Headers headers;
  std::set<std::string, std::less<>> names;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
    names.insert(entry->path().filename().string());
  for (const std::string& header : names) {
    const fs::path path = fs::path(folder) / header;
    if (!is_header_name(path) || !fs::is_regular_file(path, error)) continue;
    std::set<std::string> named;
    const auto add = [&](std::string_view possible) {
      if (const auto found = names.find(possible); found != names.end()) named.insert(*found);
    };
    const std::string text = text_of_header(path.string());
    if (!is_report(path, text))
      for_each_possible_name(text, [&](std::string_view possible) {
        add(possible);
        if (possible.find('%') == possible.npos) return;
        for (const std::string& other : names)
          if (is_numbered_as(possible, other)) named.insert(other);
      });
    for_each_pair(header, add);
    for (const std::string& other : named)
      if (other != header) headers[other].push_back(header);
  }
  return folders_[folder] = std::move(headers);
}

std::optional<OtherHeaders::Named> OtherHeaders::first_named(const std::vector<std::string>& volume) {
  std::map<std::string, std::string> canonical;  // of folders
  std::set<std::pair<std::string, std::string>> own;
  for (const std::string& file : volume) {
    std::string& folder = canonical[folder_of(file)];
    if (folder.empty()) folder = real_folder_of(file);
    own.emplace(folder, file_name(file));
  }
  for (const std::string& file : volume) {
    const std::string& folder = canonical[folder_of(file)];
    const Headers& headers = in_folder(folder);
    if (const auto found = headers.find(file_name(file)); found != headers.end())
      for (const std::string& header : found->second)
        if (!own.contains({folder, header})) return Named{file, header};
  }
  return std::nullopt;
}

}  // namespace tagrid
