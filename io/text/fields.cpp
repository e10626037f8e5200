#include "io/text/fields.h"

#include "io/text/text.h"

namespace tagrid {
namespace {

std::string_view without_space(std::string_view text) {
  constexpr std::string_view space = " \t\r\n";
  const std::size_t begin = text.find_first_not_of(space);
  return begin == text.npos ? "" : text.substr(begin, text.find_last_not_of(space) + 1 - begin);
}

}  // namespace

TextFields fields_between_semicolons(std::string_view text) {
  TextFields fields;
  for (const std::string_view part : split(text, ';'))
    if (const std::size_t equal = part.find('='); equal != part.npos)
      fields.emplace(lower_case(without_space(part.substr(0, equal))), without_space(part.substr(equal + 1)));
  return fields;
}

std::optional<std::string_view> field_of(const TextFields& fields, std::string_view name) {
  const auto found = fields.find(name);
  return found == fields.end() ? std::nullopt : std::optional<std::string_view>(found->second);
}

}  // namespace tagrid
