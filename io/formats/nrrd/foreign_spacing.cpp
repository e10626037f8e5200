#include "io/formats/nrrd/foreign_spacing.h"

#include <fmt/format.h>

#include <algorithm>

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

}  // namespace tagrid
