#include "tools/readers/hdf5/length_unit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "io/files/text.h"

namespace tagrid {
namespace {

struct NamedUnit {
  std::string_view name;
  MeterUnit unit;
};

/// Symbols, in which capitals and small letters differ in meaning.
constexpr NamedUnit symbols[] = {
    {"m", {1, 0}},          {"dm", {1, -1}},    {"cm", {1, -2}},
    {"mm", {1, -3}},        {"um", {1, -6}},    {"\xc2\xb5m", {1, -6}},
    {"\xce\xbcm", {1, -6}}, {"\xb5m", {1, -6}}, {"nm", {1, -9}},
    {"pm", {1, -12}},       {"fm", {1, -15}},   {"km", {1, 3}},
    {"\xc3\x85", {1, -10}}, {"\xc5", {1, -10}}, {"\xe2\x84\xab", {1, -10}},
    {"A", {1, -10}},        {"in", {254, -4}},  {"\"", {254, -4}},
    {"ft", {3048, -4}},     {"mil", {254, -7}},
};

/// Words, in small letters and without the "s" of several.
constexpr NamedUnit words[] = {
    {"meter", {1, 0}},        {"decimeter", {1, -1}}, {"centimeter", {1, -2}}, {"millimeter", {1, -3}},
    {"micrometer", {1, -6}},  {"micron", {1, -6}},    {"nanometer", {1, -9}},  {"picometer", {1, -12}},
    {"femtometer", {1, -15}}, {"kilometer", {1, 3}},  {"angstrom", {1, -10}},  {"ang", {1, -10}},
    {"inch", {254, -4}},      {"inche", {254, -4}},   {"foot", {3048, -4}},    {"feet", {3048, -4}},
};

}  // namespace

std::optional<MeterUnit> length_unit_of(std::string_view name) {
  name = trimmed(name);
  for (const NamedUnit& known : symbols)
    if (known.name == name) return known.unit;
  std::string word = lower_case(name);
  if (word.ends_with('s')) word.pop_back();
  if (word.ends_with("metre")) word.replace(word.size() - 2, 2, "er");
  for (const NamedUnit& known : words)
    if (known.name == word) return known.unit;
  return std::nullopt;
}

double converted(double length, const MeterUnit& from, const MeterUnit& to) {
  if (from.mantissa != to.mantissa) length = length * from.mantissa / to.mantissa;
  const int exponent = from.exponent - to.exponent;
  // A power of ten is exact, and its inverse is not.
  const double power = std::pow(10, std::abs(exponent));
  return exponent < 0 ? length / power : length * power;
}

double UnitOfAxes::convert(std::size_t axis, double length) const {
  return conversions[axis] ? converted(length, conversions[axis]->from, conversions[axis]->to) : length;
}

UnitOfAxes common_unit(const std::array<std::string, 3>& units, const std::array<bool, 3>& used) {
  UnitOfAxes common = {units, {}, ""};
  std::array<std::optional<MeterUnit>, 3> lengths;
  std::optional<std::size_t> chosen;
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (used[axis]) lengths[axis] = length_unit_of(units[axis]);
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
