#include "io/metadata/lengths.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "io/text/text.h"

namespace tagrid {
namespace {

struct Spelling {
  std::string_view text, name;
};

constexpr LengthUnit all_units[] = {{"fm", 1},      {"pm", 1e3},      {"angstrom", 1e5}, {"nm", 1e6},
                                    {"um", 1e9},    {"mm", 1e12},     {"cm", 1e13},      {"dm", 1e14},
                                    {"m", 1e15},    {"dam", 1e16},    {"hm", 1e17},      {"km", 1e18},
                                    {"mil", 254e8}, {"inch", 254e11}, {"ft", 3048e11},   {"yd", 9144e11}};

// In Unicode, micro and angstrom have two characters each, one of them in Latin-1. ImageJ escapes micro.
constexpr Spelling short_spellings[] = {
    {"\xc2\xb5m", "um"},          {"\xce\xbcm", "um"},  {"\xb5m", "um"},    {"\xc2\xb5", "um"},
    {"\xce\xbc", "um"},           {"\\u00B5m", "um"},   {"\\u03BCm", "um"}, {"\xc3\x85", "angstrom"},
    {"\xe2\x84\xab", "angstrom"}, {"\xc5", "angstrom"}, {"A", "angstrom"},  {"\"", "inch"}};

// In small letters and without the "s" of several; "metre" is "meter".
constexpr Spelling word_spellings[] = {
    {"femtometer", "fm"}, {"picometer", "pm"},      {"nanometer", "nm"},
    {"micron", "um"},     {"micrometer", "um"},     {"millimeter", "mm"},
    {"centimeter", "cm"}, {"decimeter", "dm"},      {"meter", "m"},
    {"kilometer", "km"},  {"angstrom", "angstrom"}, {"\xc3\xa5ngstr\xc3\xb6m", "angstrom"},
    {"ang", "angstrom"},  {"mil", "mil"},           {"thou", "mil"},
    {"inch", "inch"},     {"inche", "inch"},        {"in", "inch"},
    {"foot", "ft"},       {"feet", "ft"},           {"yard", "yd"}};

std::string_view usual_name(std::string_view name) {
  for (const Spelling& spelling : short_spellings)
    if (spelling.text == name) return spelling.name;
  std::string word = lower_case(name);
  // In a name in capitals only, M is not the prefix mega.
  const bool is_in_capitals = std::ranges::all_of(name, [](char c) { return c >= 'A' && c <= 'Z'; });
  if (is_in_capitals)
    for (const LengthUnit& unit : all_units)
      if (unit.name == word) return unit.name;
  if (word.ends_with('s')) word.pop_back();
  if (word.ends_with("metre")) word.replace(word.size() - 2, 2, "er");
  for (const Spelling& spelling : word_spellings)
    if (spelling.text == word) return spelling.name;
  return name;
}

/// True if the unit of an axis, or of a coordinate, says something about a length.
bool is_used(const Geometry& geometry, std::size_t axis) {
  return geometry.has_directions || !std::isnan(geometry.spacing[axis]);
}

}  // namespace

std::optional<LengthUnit> length_unit(std::string_view name) {
  const std::string_view usual = usual_name(trimmed(name));
  const auto found = std::ranges::find(all_units, usual, &LengthUnit::name);
  return found == std::end(all_units) ? std::nullopt : std::optional(*found);
}

double converted(double length, const LengthUnit& from, const LengthUnit& to) {
  const auto is_whole = [](double ratio) { return ratio == std::floor(ratio); };
  const double factor = from.femtometers / to.femtometers, divisor = to.femtometers / from.femtometers;
  if (is_whole(factor)) return length * factor;
  if (is_whole(divisor)) return length / divisor;
  return length * from.femtometers / to.femtometers;
}

CommonUnit common_unit(const Geometry& geometry) {
  CommonUnit common{.name = "", .is_mixed = false, .is_known = true};
  bool is_first = true;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!is_used(geometry, axis)) continue;
    const auto unit = length_unit(geometry.units[axis]);
    const std::string name = unit ? std::string(unit->name) : geometry.units[axis];
    common.is_known = common.is_known && unit;
    if (is_first)
      common.name = name;
    else
      common.is_mixed = common.is_mixed || name != common.name;
    is_first = false;
  }
  if (is_first) common = {.name = geometry.units[0], .is_mixed = false, .is_known = false};
  return common;
}

Geometry in_unit(const Geometry& geometry, std::string_view name) {
  const LengthUnit wanted = *length_unit(name);
  Geometry changed = geometry;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto unit = length_unit(geometry.units[axis]);
    changed.units[axis] = wanted.name;
    // An axis whose spacing is not known may have no unit.
    if (!unit || unit->name == wanted.name) continue;
    const auto convert = [&](double length) { return converted(length, *unit, wanted); };
    changed.origin[axis] = convert(geometry.origin[axis]);
    // With directions, units are those of coordinates.
    if (geometry.has_directions)
      for (auto& direction : changed.directions) direction[axis] = convert(direction[axis]);
    else
      changed.spacing[axis] = convert(geometry.spacing[axis]);
  }
  if (geometry.has_directions && changed.directions != geometry.directions)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto& d = changed.directions[axis];
      changed.spacing[axis] = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    }
  return changed;
}

Geometry in_one_unit(const Geometry& geometry) {
  const CommonUnit unit = common_unit(geometry);
  return unit.is_known ? in_unit(geometry, unit.name) : geometry;
}

std::string lost_by_mixed_units(const Geometry& geometry) {
  const CommonUnit unit = common_unit(geometry);
  if (!unit.is_mixed || unit.is_known) return "";
  return fmt::format(
      "axes have different units ({}, {}, {}), which are not all known; the numbers are written as they are",
      quoted(std::string_view(geometry.units[0])), quoted(std::string_view(geometry.units[1])),
      quoted(std::string_view(geometry.units[2])));
}

}  // namespace tagrid
