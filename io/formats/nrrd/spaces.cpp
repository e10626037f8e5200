#include "io/formats/nrrd/spaces.h"

#include <string_view>

#include "io/text/text.h"

namespace tagrid {

std::optional<std::array<int, 3>> signs_of_space(const std::string& space) {
  const std::string name = lower_case(space);
  constexpr std::array<std::array<std::string_view, 2>, 3> words = {
      {{"right", "left"}, {"anterior", "posterior"}, {"superior", "inferior"}}};
  std::array<int, 3> signs = {};
  std::string_view rest = name;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t end = name.size() == 3 ? 1 : std::min(rest.find('-'), rest.size());
    const std::string_view word = rest.substr(0, end);
    for (std::size_t i = 0; i < 2; ++i)
      if (word == words[axis][i] || (name.size() == 3 && word[0] == words[axis][i][0]))
        signs[axis] = i == 0 ? 1 : -1;
    if (signs[axis] == 0) return std::nullopt;
    rest.remove_prefix(std::min(end + (name.size() == 3 ? 0 : 1), rest.size()));
  }
  return rest.empty() ? std::optional(signs) : std::nullopt;
}

std::string short_name_of_space(const std::string& space) {
  std::string name;
  if (const auto signs = signs_of_space(space)) {
    constexpr std::array<std::string_view, 3> letters = {"LR", "PA", "IS"};
    for (std::size_t axis = 0; axis < 3; ++axis) name += letters[axis][(*signs)[axis] > 0 ? 1 : 0];
    return name;
  }
  for (const char c : space) {
    const bool is_plain =
        (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-';
    if (is_plain && name.size() < 32) name += c;
  }
  return name;
}

}  // namespace tagrid
