#include "tools/archive/other_headers.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/system/files.h"
#include "io/text/text.h"
#include "tools/archive/named_files.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

std::string real_folder_of(const std::string& file) {
  const std::string folder = folder_of(file);
  return without_links(folder).value_or(fs::path(folder)).string();
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
  return "it does not have the name of " + header + ", so it may also belong to other volumes";
}

OtherHeaders::Listing OtherHeaders::list(const std::string& folder) {
  Listing found;
  std::vector<FolderEntry> entries;
  if (!files().list(folder, entries)) throw world_error("cannot read", folder, errno);
  for (const FolderEntry& entry : entries) {
    const bool is_link = entry.type == FileType::link;
    if (is_folder(folder, entry)) {
      if (!is_link) found.below.push_back(entry.name);
      continue;
    }
    found.files.push_back(entry.name);
    if (is_link) found.links.push_back(entry.name);
    if (kind_of_header(entry.name) && is_file(folder, entry)) found.headers.push_back(entry.name);
  }
  std::ranges::sort(found.headers);
  return found;
}

void OtherHeaders::add_headers(const std::string& place, const Listing& listing, const std::string& folder,
                               const std::vector<std::string>& files, const std::vector<std::string>& before,
                               std::uint64_t limit, Headers& headers) {
  if (listing.headers.empty()) return;
  MeantFiles meant;
  for (const std::string& file : files)
    for (const std::string& path : before) meant.add(path + file, file);
  for (const std::string& link : listing.links) {
    std::error_code error;
    const fs::path target = fs::weakly_canonical(fs::path(place) / link, error);
    if (!error && target.parent_path() == folder) meant.add(link, target.filename().string());
  }
  for (const std::string& name : listing.headers) {
    const std::string header = (fs::path(place) / name).string(), stem = fs::path(name).stem().string();
    const HeaderKind& kind = *kind_of_header(name);
    std::set<std::string> named = files_named_by(header, kind, meant, limit);
    for (const std::string_view end : words_of(kind.pair))
      meant.find(end == "-" ? stem : stem + std::string(end), named);
    for (const std::string& file : named) headers[file].push_back(header);
  }
}

const OtherHeaders::Headers& OtherHeaders::in_folder(const std::string& folder) {
  if (const auto read = folders_.find(folder); read != folders_.end()) return read->second;
  constexpr std::uint64_t everything = std::numeric_limits<std::uint64_t>::max();
  constexpr std::uint64_t nearby = std::uint64_t{4} << 20;
  Headers headers;
  const Listing listing = list(folder);
  add_headers(folder, listing, folder, listing.files, {""}, everything, headers);
  const fs::path here(folder), above = here.parent_path();
  const std::string from_above = here.filename().string() + "/";
  const auto add_nearby = [&](const std::string& place, const std::vector<std::string>& before) {
    try {
      // A directory is above many others.
      const auto known = place == above ? above_.find(place) : above_.end();
      const Listing there = known == above_.end() ? list(place) : known->second;
      add_headers(place, there, folder, listing.files, before, nearby, headers);
      if (place == above && known == above_.end()) above_[place] = {{}, {}, there.headers, there.links};
    } catch (const WorldError&) {  // it may be of others
    }
  };
  for (const std::string& name : listing.below) add_nearby((here / name).string(), {"../", from_above});
  if (above != here) add_nearby(above.string(), {from_above});
  return folders_[folder] = std::move(headers);
}

std::optional<OtherHeaders::Named> OtherHeaders::first_named(const std::vector<std::string>& volume) {
  std::map<std::string, std::string> canonical;  // of folders
  std::set<std::string> own;
  for (const std::string& file : volume) {
    std::string& folder = canonical[folder_of(file)];
    if (folder.empty()) folder = real_folder_of(file);
    own.insert((fs::path(folder) / file_name(file)).string());
  }
  for (const std::string& file : volume) {
    const std::string& folder = canonical[folder_of(file)];
    const Headers& headers = in_folder(folder);
    if (const auto found = headers.find(file_name(file)); found != headers.end())
      for (const std::string& header : found->second)
        if (!own.contains(header) && header != (fs::path(folder) / file_name(file)).string())
          return Named{file, fs::path(header).lexically_relative(folder).string()};
  }
  return std::nullopt;
}

}  // namespace tagrid
