#include "io/formats/vendors/sections.h"

#include <algorithm>

#include "io/errors/errors.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

constexpr std::size_t largest_file = std::size_t{1} << 20;

/// "volume1" for a line "{Volume1}"; "" if it does not begin a group that is a volume, as
/// "{volumeprimitive1}".
std::string volume_begun_by(std::string_view line) {
  if (!line.starts_with('{') || !line.ends_with('}')) return "";
  std::string name = lower_case(trimmed(line.substr(1, line.size() - 2)));
  const std::string_view word = "volume";
  return name.starts_with(word) && std::all_of(name.begin() + word.size(), name.end(), is_digit) ? name : "";
}

}  // namespace

Sections parse_sections(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);  // some editors write this in front of UTF-8
  Sections sections;
  std::string section, first_volume;
  bool is_other_volume = false;
  while (!text.empty()) {
    const std::string_view line = trimmed(take_line(text));
    const std::size_t equals = line.find('=');
    if (line.starts_with('{') && line.ends_with('}')) {
      const std::string volume = volume_begun_by(line);
      is_other_volume = !volume.empty() && !first_volume.empty();
      if (first_volume.empty()) first_volume = volume;
    }
    if (is_other_volume) continue;
    if (line.starts_with('[') && line.ends_with(']'))
      section = lower_case(line.substr(1, line.size() - 2));
    else if (equals != line.npos)
      sections.emplace(section + "/" + lower_case(trimmed(line.substr(0, equals))),
                       trimmed(line.substr(equals + 1)));
  }
  return sections;
}

std::vector<std::string> volumes_in(std::string_view text) {
  std::vector<std::string> volumes;
  while (!text.empty())
    if (std::string volume = volume_begun_by(trimmed(take_line(text))); !volume.empty())
      volumes.push_back(std::move(volume));
  return volumes;
}

std::string read_description(FileBytes& file) {
  constexpr std::size_t piece = std::size_t{1} << 14;
  std::string text;
  for (std::size_t read = piece; read == piece;) {
    if (text.size() > largest_file)
      throw BrokenInput(file.name() + ": is too long for the description of a volume");
    const std::size_t known = text.size();
    text.resize(known + piece);
    read = file.read(reinterpret_cast<std::byte*>(text.data()) + known, piece);
    text.resize(known + read);
  }
  return text;
}

Sections read_sections(FileBytes& file) { return parse_sections(read_description(file)); }

const std::string& required(const Sections& sections, const std::string& key, const std::string& file) {
  const auto found = sections.find(key);
  if (found != sections.end() && !found->second.empty()) return found->second;
  const std::size_t slash = key.find('/');
  throw BrokenInput("{}: {} is missing in section [{}]", file, key.substr(slash + 1), key.substr(0, slash));
}

}  // namespace tagrid
