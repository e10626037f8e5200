#include "tools/formats/hdf5/reader/unit_of_axes.h"

#include <fmt/format.h>

#include <algorithm>

namespace tagrid {
double UnitOfAxes::convert(std::size_t axis, double length) const {
  return conversions[axis] ? converted(length, conversions[axis]->from, conversions[axis]->to) : length;
}

UnitOfAxes common_unit(const std::array<std::string, 3>& units, const std::array<bool, 3>& used) {
  UnitOfAxes common = {units, {}, ""};
  std::array<std::optional<LengthUnit>, 3> lengths;
  std::optional<std::size_t> chosen;
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (used[axis]) lengths[axis] = length_unit(units[axis]);
  const auto frequency = [&](std::size_t axis) { return std::ranges::count(lengths, lengths[axis]); };
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (lengths[axis] && (!chosen || frequency(axis) > frequency(*chosen))) chosen = axis;
  for (std::size_t axis = 0; chosen && axis < 3; ++axis) {
    if (!lengths[axis]) continue;
    if (lengths[axis] != lengths[*chosen]) common.conversions[axis] = {*lengths[axis], *lengths[*chosen]};
    common.units[axis] = units[*chosen];
  }
  std::string list;
  bool is_one = true;
  std::optional<std::size_t> first;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!used[axis]) continue;
    if (!first) first = axis;
    is_one &= common.units[axis] == common.units[*first];
    list += fmt::format("{}{} {}", list.empty() ? "" : ", ", "xyz"[axis],
                        units[axis].empty() ? "none" : units[axis]);
  }
  if (!is_one)
    common.remark = fmt::format(
        "its axes have units that cannot be converted into each other ({}); distances along them are kept as "
        "they are, and other formats may take them for distances in one unit",
        list);
  return common;
}

}  // namespace tagrid
