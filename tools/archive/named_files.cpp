#include "tools/archive/named_files.h"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/file_bytes.h"
#include "io/system/files.h"
#include "io/text/paths.h"
#include "io/text/text.h"
#include "io/text/utf8.h"

namespace tagrid {
namespace {

constexpr std::string_view hdf5_signature = "\x89HDF\r\n\x1a\n";
constexpr std::size_t longest_name = 4096;

constexpr const char* pair_of_hdr = ".img .img.gz .raw .dat .bil .bsq .bip .bin -";
constexpr std::array<HeaderKind, 32> kinds = {{
    {".nhdr", {"data file", "datafile"}},
    {".nrrd", {"data file", "datafile"}},
    {".mhd", {"elementdatafile"}},
    {".mha", {"elementdatafile"}},
    {".dat", {"objectfilename"}},
    {".json", {"refs", ".zarray", ".zgroup", "zarr.json"}},
    {".hdr", {}, pair_of_hdr},
    {".xtekct", {}, ".vol"},
    {".vol.info", {}, ".vol"},
    {".raw.info", {}, ".raw"},
    {".pcr", {}, ".vol"},
    {".xtekvolume"},
    {".vgi"},
    {".vrt"},
    {".xmf"},
    {".xdmf"},
    {".pvti"},
    {".pvd"},
    {".bov"},
    {".ome"},
    {".ome.xml"},
    {".h5"},
    {".hdf5"},
    {".hdf"},
    {".he5"},
    {".nxs"},
    {".nx5"},
    {".cxi"},
    {".nc"},
    {".vtkhdf"},
    {".emd"},
    {".ims"},
}};

/// The last steps of a path, with slashes of any system.
std::string_view last_steps(std::string_view path, int steps) {
  std::size_t at = path.size();
  for (; steps > 0 && at > 0; --steps) {
    at = path.find_last_of("/\\", at - 1);
    if (at == path.npos) return path;
  }
  return at < path.size() ? path.substr(at + 1) : path;
}

bool has_digits_only(std::string_view text) { return std::ranges::all_of(text, is_digit); }

/// "slice%.raw" for slice%03d.raw, which means slice001.raw; "" if there is no such number.
std::string pattern_of(std::string_view text) {
  const std::size_t percent = text.find('%');
  if (percent == text.npos) return "";
  const std::size_t d = text.find_first_not_of("0123456789", percent + 1);
  if (d == text.npos || text[d] != 'd') return "";
  std::string_view before = text.substr(0, percent), after = text.substr(d + 1);
  after = after.substr(0, after.find(' '));  // NRRD and MetaImage have the first and last number there
  while (!before.empty() && is_digit(before.back())) before.remove_suffix(1);
  while (!after.empty() && is_digit(after.front())) after.remove_prefix(1);
  return lower_case(before) + '%' + lower_case(after);
}

/// A text with its entities of XML, as &amp; and &#228;, and the \u00e4 of JSON replaced.
std::string unescaped(std::string_view text) {
  constexpr std::array<std::pair<std::string_view, char>, 5> entities = {
      {{"&amp;", '&'}, {"&lt;", '<'}, {"&gt;", '>'}, {"&quot;", '"'}, {"&apos;", '\''}}};
  std::string out;
  while (!text.empty()) {
    const auto* entity =
        std::ranges::find_if(entities, [&](const auto& one) { return text.starts_with(one.first); });
    if (entity != entities.end()) {
      out += entity->second;
      text.remove_prefix(entity->first.size());
      continue;
    }
    const bool is_json = text.starts_with("\\u"), is_hex = is_json || text.starts_with("&#x");
    std::uint32_t code = 0;
    if (is_hex || text.starts_with("&#")) {
      const char* from = text.data() + (is_hex && !is_json ? 3 : 2);
      const char* to = text.data() + std::min<std::size_t>(text.size(), is_json ? 6 : 10);
      const char* end = std::from_chars(from, std::max(from, to), code, is_hex ? 16 : 10).ptr;
      if (code > 0 && code < 0x10000) {
        append_utf8(code, out);
        text.remove_prefix(static_cast<std::size_t>(end - text.data()));
        if (!is_json && text.starts_with(';')) text.remove_prefix(1);
        continue;
      }
    }
    out += text.front();
    text.remove_prefix(1);
  }
  return out;
}

/// Calls use(line, the character after it) for each part between control characters, up to about
/// byte `limit`, until use() returns false. Parts that are longer than a block are split; the end
/// of one piece is repeated in the next, so that no name is cut.
template <class Use>
void for_each_line(FileBytes& file, std::uint64_t limit, Use use) {
  constexpr std::size_t block = std::size_t{1} << 20;
  for (std::string buffer; true;) {
    const std::size_t kept = buffer.size();
    buffer.resize(kept + block);
    const std::size_t count = file.read(reinterpret_cast<std::byte*>(buffer.data() + kept), block);
    buffer.resize(kept + count);
    std::string_view rest = buffer;
    const auto is_end = [](unsigned char c) { return c < 32 && c != '\r' && c != '\t'; };
    for (auto end = std::ranges::find_if(rest, is_end); end != rest.end();
         end = std::ranges::find_if(rest, is_end)) {
      const auto size = static_cast<std::size_t>(end - rest.begin());
      if (!use(rest.substr(0, size), *end)) return;
      rest.remove_prefix(size + 1);
    }
    const bool is_last = count < block || file.position() >= limit;
    if (is_last || rest.size() >= block) {
      if (!use(rest, '\n') || is_last) return;
      rest.remove_prefix(rest.size() - longest_name);
    }
    buffer = std::string(rest);
  }
}

/// Calls use(part) for the parts of a text between delimiters.
template <class Use>
void for_each_part(std::string_view text, std::string_view delimiters, Use use) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find_first_of(delimiters), text.size());
    if (const auto part = trimmed(text.substr(0, end)); !part.empty() && part.size() <= longest_name)
      use(part);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

}  // namespace

const HeaderKind* kind_of_header(const std::string& name) {
  const std::string lower = lower_case(name);
  const auto* found =
      std::ranges::find_if(kinds, [&](const HeaderKind& one) { return lower.ends_with(one.ending); });
  return found == kinds.end() ? nullptr : found;
}

void MeantFiles::add(const std::string& name, const std::string& file) {
  names_.emplace(lower_case(name), std::pair(name, file));
}

void MeantFiles::find(std::string_view text, std::set<std::string>& files) const {
  for (const int steps : {1, 2}) {
    std::string name(last_steps(text, steps));
    std::ranges::replace(name, '\\', '/');
    const auto [begin, end] = names_.equal_range(lower_case(name));
    const bool is_exact = std::any_of(begin, end, [&](const auto& one) { return one.second.first == name; });
    for (auto one = begin; one != end; ++one)
      if (!is_exact || one->second.first == name) files.insert(one->second.second);
  }
}

void MeantFiles::find_numbered(const std::set<std::string>& patterns, std::set<std::string>& files) const {
  if (patterns.empty()) return;
  for (const auto& [name, meant] : names_)
    for (std::size_t end = 0, at = 0; (at = name.find_first_of("0123456789", end)) != name.npos;) {
      end = std::min(name.find_first_not_of("0123456789", at), name.size());
      if (patterns.contains(name.substr(0, at) + '%' + name.substr(end))) files.insert(meant.second);
    }
}

std::set<std::string> files_named_by(const std::string& path, const HeaderKind& kind, const MeantFiles& meant,
                                     std::uint64_t limit) {
  std::set<std::string> files, patterns;
  FileBytes file(path);
  if (file.peek(hdf5_signature.size()) == hdf5_signature) {
    // Names end with a zero byte there. What is before them may happen to be a letter.
    for_each_line(file, limit, [&](std::string_view name, char end) {
      if (end != '\0' || name.size() < 4 || name.size() > longest_name) return true;
      meant.find(name, files);
      meant.find(name.substr(1), files);
      return true;
    });
    return files;
  }
  const bool is_json = kind.ending == ".json", has_word = !kind.words.front().empty();
  bool is_header = !has_word;
  const auto look_at = [&](std::string_view part) {
    is_header =
        is_header || (has_word && std::ranges::count(kind.words, lower_case(last_steps(part, 1))) > 0);
    if ((!is_header && !is_json) || has_digits_only(part)) return;
    meant.find(part, files);
    for (const int steps : {1, 2})
      if (auto pattern = pattern_of(last_steps(part, steps)); !pattern.empty())
        patterns.insert(std::move(pattern));
  };
  for_each_line(file, limit, [&](std::string_view line, char end) {
    const std::string_view text = trimmed(line);
    // Samples follow the header of NRRD after an empty line, and that of MetaImage after the word LOCAL.
    if (text.empty() && kind.ending.starts_with(".n")) return false;
    if (kind.ending == ".mha" && lower_case(text.substr(0, 15)) == "elementdatafile" &&
        text.ends_with("LOCAL"))
      return false;
    if (text.starts_with('#')) return end != '\0';                                // a comment
    if (has_word && is_header && has_digits_only(text)) meant.find(text, files);  // in a list of NRRD
    const auto look_at_all = [&](std::string_view all) {
      for_each_part(all, is_json ? "\"" : "\"'<>\r", look_at);
      if (is_json) return;
      for_each_part(all, "\r", look_at);
      for_each_part(all, "=:\r", look_at);
      for_each_part(all, "\"'<>=:,;()[]{} \t\r", look_at);
    };
    look_at_all(line);
    if (line.find('&') != line.npos || line.find("\\u") != line.npos) look_at_all(unescaped(line));
    return end != '\0';
  });
  if (!is_header) return {};
  meant.find_numbered(patterns, files);
  return files;
}

namespace {

namespace fs = std::filesystem;

std::string real_folder_of(const std::string& file) {
  const std::string folder = folder_of(file);
  return text_of(without_links(path_of(folder)).value_or(path_of(folder)));
}

}  // namespace

std::string not_own_name(const std::string& input, const std::string& file) {
  const std::string name = name_of_path(file), header = name_of_path(input);
  if (name == header) return "";
  // volume.ome.tif has volume.raw, too.
  for (std::string stem = text_of(path_of(header).stem());; stem = text_of(path_of(stem).stem())) {
    if (name.starts_with(stem)) {
      std::string_view rest = std::string_view(name).substr(stem.size());
      if (!rest.empty() && (rest.front() == '_' || rest.front() == '-')) rest.remove_prefix(1);
      rest.remove_prefix(std::min(rest.find_first_not_of("0123456789"), rest.size()));
      if (rest.empty() || rest.front() == '.') return "";
    }
    if (path_of(stem).extension().empty()) break;
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
    const fs::path target = real_path_if_known(path_of(place) / path_of(link));
    if (target.parent_path() == path_of(folder)) meant.add(link, text_of(target.filename()));
  }
  for (const std::string& name : listing.headers) {
    const std::string header = path_in(place, name), stem = text_of(path_of(name).stem());
    const HeaderKind& kind = *kind_of_header(name);
    std::set<std::string> named;
    try {
      named = files_named_by(header, kind, meant, limit);
    } catch (const WorldError&) {
      if (status_of_name(header)) throw;
      continue;  // another run has just removed it
    }
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
  const fs::path here(path_of(folder)), above = here.parent_path();
  const std::string from_above = text_of(here.filename()) + "/";
  const auto add_nearby = [&](const std::string& place, const std::vector<std::string>& before) {
    try {
      // A directory is above many others.
      const auto known = path_of(place) == above ? above_.find(place) : above_.end();
      const Listing there = known == above_.end() ? list(place) : known->second;
      add_headers(place, there, folder, listing.files, before, nearby, headers);
      if (path_of(place) == above && known == above_.end())
        above_[place] = {{}, {}, there.headers, there.links};
    } catch (const WorldError&) {  // it may be of others
    }
  };
  for (const std::string& name : listing.below)
    add_nearby(text_of(here / path_of(name)), {"../", from_above});
  if (above != here) add_nearby(text_of(above), {from_above});
  return folders_[folder] = std::move(headers);
}

std::optional<OtherHeaders::Named> OtherHeaders::first_named(const std::vector<std::string>& volume) {
  std::map<std::string, std::string> canonical;  // of folders
  std::set<std::string> own;
  for (const std::string& file : volume) {
    std::string& folder = canonical[folder_of(file)];
    if (folder.empty()) folder = real_folder_of(file);
    own.insert(path_in(folder, name_of_path(file)));
  }
  for (const std::string& file : volume) {
    const std::string& folder = canonical[folder_of(file)];
    const Headers& headers = in_folder(folder);
    if (const auto found = headers.find(name_of_path(file)); found != headers.end())
      for (const std::string& header : found->second)
        if (!own.contains(header) && header != path_in(folder, name_of_path(file)))
          return Named{file, text_of(relative_path(path_of(header), path_of(folder)))};
  }
  return std::nullopt;
}

}  // namespace tagrid
