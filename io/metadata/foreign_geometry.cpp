#include "io/metadata/foreign_geometry.h"

#include <fmt/format.h>

#include <algorithm>

#include "io/metadata/lengths.h"
#include "io/text/text.h"

namespace tagrid {

void set_spacing(const std::vector<ForeignNumber>& numbers, const std::vector<std::string>& names,
                 NegativeSpacing negative, Geometry& geometry, std::vector<std::string>& warnings) {
  constexpr std::string_view axis_names = "xyz";
  for (std::size_t axis = 0; axis < std::min<std::size_t>(numbers.size(), 3); ++axis) {
    const ForeignNumber& number = numbers[axis];
    if (number.is_absent()) continue;
    const std::string& name = names[std::min(axis, names.size() - 1)];
    const std::string consequence =
        fmt::format("the spacing along {} is unknown, and counts as 1 where one is needed", axis_names[axis]);
    const bool is_impossible =
        number.is_number() &&
        (number.value == 0 || (number.value < 0 && negative == NegativeSpacing::is_unknown));
    if (number.is_number() && !is_impossible) {
      geometry.spacing[axis] = number.value;
      geometry.has_spacing = true;
    }
    if (std::string remark = remark_on(number, name, consequence); !remark.empty())
      warnings.push_back(std::move(remark));
    else if (is_impossible)
      warnings.push_back(
          fmt::format("{}: a distance between samples cannot be {}; {}", name, number.value, consequence));
  }
}

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

std::vector<std::string> lost_places(const Geometry& geometry, const OneSpaceFormat& format) {
  std::vector<std::string> lost;
  const CommonUnit unit = common_unit(geometry);
  if (std::string mixed = lost_by_mixed_units(geometry); !mixed.empty())
    lost.push_back(std::move(mixed));
  else if (!unit.name.empty() && !unit.is_known)
    lost.push_back(fmt::format("{} does not know the unit {}; {}", format.name,
                               quoted(std::string_view(unit.name)), format.unknown_unit));
  if (has_unknown_spacing(geometry))
    lost.push_back(fmt::format("{} cannot record that a spacing is unknown; 1 is written", format.name));
  if ((geometry.has_directions || geometry.has_origin) && !signs_of_space(geometry.space))
    lost.push_back(fmt::format(
        "{} means {}; the space of the volume is {}, and its positions are written as they are", format.name,
        format.space, geometry.space.empty() ? "not known" : quoted(std::string_view(geometry.space))));
  return lost;
}

}  // namespace tagrid
