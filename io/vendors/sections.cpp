#include "io/vendors/sections.h"

#include <fmt/format.h>

#include "io/files/errors.h"
#include "io/files/text.h"

namespace tagrid {
namespace {

constexpr std::size_t largest_file = std::size_t{1} << 20;

}  // namespace

Sections parse_sections(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);  // some editors write this in front of UTF-8
  Sections sections;
  std::string section;
  while (!text.empty()) {
    const std::string_view line = trimmed(take_line(text));
    const std::size_t equals = line.find('=');
    if (line.starts_with('[') && line.ends_with(']'))
      section = lower_case(line.substr(1, line.size() - 2));
    else if (equals != line.npos)
      sections.emplace(section + "/" + lower_case(trimmed(line.substr(0, equals))),
                       trimmed(line.substr(equals + 1)));
  }
  return sections;
}

Sections read_sections(FileBytes& file) {
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
  return parse_sections(text);
}

const std::string& required(const Sections& sections, const std::string& key, const std::string& file) {
  const auto found = sections.find(key);
  if (found != sections.end() && !found->second.empty()) return found->second;
  const std::size_t slash = key.find('/');
  throw BrokenInput(
      fmt::format("{}: {} is missing in section [{}]", file, key.substr(slash + 1), key.substr(0, slash)));
}

}  // namespace tagrid
