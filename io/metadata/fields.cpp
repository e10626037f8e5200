#include "io/metadata/fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "io/errors/errors.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

using Vector = std::array<double, 3>;
using Fields = std::map<std::string_view, std::string_view>;

[[noreturn]] void refuse(const std::string& what) { throw BrokenInput("NRRD header: " + what); }

Fields fields_of(const MetadataEntries& entries) {
  Fields fields;
  for (const MetadataEntry& entry : entries) {
    if (entry.kind != MetadataEntry::Kind::field) continue;
    if (is_storage_field(entry.field)) refuse(std::string(entry.field) + " is not expected here");
    if (!fields.emplace(entry.field, entry.value).second)
      refuse(std::string(entry.field) + " is given twice");
  }
  return fields;
}

std::optional<std::string_view> find(const Fields& fields, std::string_view name) {
  const auto found = fields.find(name);
  return found == fields.end() ? std::nullopt : std::optional(found->second);
}

/// Three numbers; NaN means unknown.
Vector three_numbers(std::string_view field, std::string_view value) {
  const auto words = words_of(value);
  Vector numbers = {};
  bool good = words.size() == 3;
  for (std::size_t i = 0; good && i < 3; ++i) {
    const auto number = number_of(words[i]);
    good = number && !std::isinf(*number);
    if (good) numbers[i] = *number;
  }
  if (!good) refuse(std::string(field) + " " + quoted(value) + " must be 3 numbers");
  return numbers;
}

[[noreturn]] void refuse_none(std::string_view field) {
  refuse(std::string(field) + " with \"none\" is not supported: each of the three axes must be one of space");
}

/// Removes and returns the vector "(a,b,c)" in front of `rest`. An unknown vector is three NaNs.
Vector take_vector(std::string_view field, std::string_view& rest) {
  const std::string_view begin = trimmed(rest);
  if (lower_case(begin.substr(0, 4)) == "none") refuse_none(field);
  const std::size_t end = begin.find(')') + 1;  // 0 without a parenthesis
  const auto numbers = vector_of(begin.substr(0, end));
  const auto is_unknown = [](double number) { return std::isnan(number); };
  if (!numbers || numbers->size() != 3 ||
      std::ranges::any_of(*numbers, [](double n) { return std::isinf(n); }) ||
      std::ranges::any_of(*numbers, is_unknown) != std::ranges::all_of(*numbers, is_unknown))
    refuse(std::string(field) + ": " + quoted(rest) + " must begin with a vector (a,b,c) of 3 numbers");
  rest = begin.substr(end);
  return {(*numbers)[0], (*numbers)[1], (*numbers)[2]};
}

void expect_end(std::string_view field, std::string_view rest) {
  if (!words_of(rest).empty()) refuse(std::string(field) + ": unexpected " + quoted(rest) + " at the end");
}

void read_spacings(std::string_view value, Geometry& geometry) {
  geometry.spacing = three_numbers("spacings", value);
  geometry.has_spacing = true;
  for (double spacing : geometry.spacing)
    if (spacing == 0) refuse("a spacing is 0");
}

void read_directions(std::string_view rest, Geometry& geometry) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Vector d = take_vector("space directions", rest);
    if (std::isnan(d[0])) refuse_none("space directions");
    geometry.directions[axis] = d;
    geometry.spacing[axis] = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  }
  expect_end("space directions", rest);
  geometry.has_spacing = geometry.has_directions = true;
  if (determinant(geometry.directions) == 0) refuse("the space directions do not span a volume");
}

void check_space(const Fields& fields) {
  if (const auto value = find(fields, "space dimension"); value && *value != "3")
    refuse("only a space dimension of 3 is supported");
  const std::string space = lower_case(find(fields, "space").value_or(""));
  if (space.ends_with("time") || space == "rast" || space == "last" || space == "lpst")
    refuse("the space " + quoted(space) + " has four dimensions; 3 are supported");
}

/// A volume has one number at each position, and each of its axes is spatial. With the other kinds of the
/// standard, an axis goes through the parts of one value (colors, vectors, tensors, complex numbers), the
/// members of a list, or moments in time. A grid across such an axis would interpolate between red and green.
/// "none" and "???" give no information, like a header without kinds; writers use "domain" for spatial axes.
void check_kinds(std::string_view value) {
  const auto kinds = words_of(value);
  if (kinds.size() != 3) refuse("kinds: " + quoted(value) + ": must be 3 words, one for each axis");
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (is_spatial_kind(kinds[axis])) continue;
    refuse("kinds: axis " + std::to_string(axis) + " has kind " + quoted(kinds[axis]) +
           ", so this is not a volume of single values; all three axes must have kind domain, space or none; "
           "extract one component or time point first, for example with unu slice");
  }
}

/// Reads strings in quotes; \\" is a quote in a string. Anything else is ignored, because units are not
/// needed to place a sample.
void read_units(std::string_view value, Geometry& geometry) {
  std::array<std::string, 3> units;
  for (std::string& unit : units) {
    const std::size_t open = value.find_first_not_of(" \t");
    if (open == value.npos || value[open] != '"') return;
    value.remove_prefix(open + 1);
    for (; !value.empty() && value.front() != '"'; value.remove_prefix(1)) {
      if (value.front() == '\\' && value.size() > 1) value.remove_prefix(1);
      unit += value.front();
    }
    if (value.empty()) return;
    value.remove_prefix(1);
    if (unit == "???" || lower_case(unit) == "none") unit.clear();
  }
  if (words_of(value).empty()) geometry.units = units;
}

/// An axis min is the low edge of the first sample, unless the header says that samples are points.
void read_axis_mins(std::string_view value, const Fields& fields, Geometry& geometry) {
  const Vector mins = three_numbers("axis mins", value);
  const auto centers = words_of(find(fields, "centers").value_or(""));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (std::isnan(mins[axis])) continue;
    const bool at_points = axis < centers.size() && lower_case(centers[axis]) == "node";
    const double spacing = spacing_or_1(geometry, axis);
    geometry.origin[axis] = at_points ? mins[axis] : mins[axis] + spacing / 2;
    geometry.has_origin = true;
  }
}

}  // namespace

Geometry geometry_of_fields(const MetadataEntries& entries) {
  const Fields fields = fields_of(entries);
  check_space(fields);
  if (const auto value = find(fields, "kinds")) check_kinds(*value);
  Geometry geometry;
  if (const auto value = find(fields, "spacings")) read_spacings(*value, geometry);
  if (const auto value = find(fields, "space directions")) read_directions(*value, geometry);
  geometry.space = find(fields, "space").value_or("");
  // "units" are those of the spacings; with directions, lengths are in "space units".
  if (const auto value = find(fields, geometry.has_directions ? "space units" : "units"))
    read_units(*value, geometry);
  if (const auto value = find(fields, "space origin")) {
    std::string_view rest = *value;
    const Vector origin = take_vector("space origin", rest);
    expect_end("space origin", rest);
    geometry.has_origin = !std::isnan(origin[0]);
    if (geometry.has_origin) geometry.origin = origin;
  } else if (const auto mins = find(fields, "axis mins"); mins && !geometry.has_directions) {
    read_axis_mins(*mins, fields, geometry);
  }
  return geometry;
}

namespace {

std::string in_parentheses(const Vector& v) { return fmt::format("({},{},{})", v[0], v[1], v[2]); }

std::string in_quotes(const std::array<std::string, 3>& units) {
  std::string list;
  for (const std::string& unit : units) {
    list += list.empty() ? "\"" : " \"";
    for (const char c : unit)
      if (c == '"' || c == '\\')
        list += {'\\', c};
      else if (static_cast<unsigned char>(c) >= ' ')
        list += c;
    list += '"';
  }
  return list;
}

}  // namespace

void add_fields(const Geometry& geometry, MetadataEntries& entries) {
  // A space says what vectors mean: without vectors, only spacings can be said.
  const bool has_space = geometry.has_directions || geometry.has_origin;
  if (has_space) {
    auto directions = geometry.directions;
    if (!geometry.has_directions)
      for (std::size_t axis = 0; axis < 3; ++axis) directions[axis][axis] = spacing_or_1(geometry, axis);
    if (geometry.space.empty())
      entries.add_field("space dimension", "3");
    else
      entries.add_field("space", geometry.space);
    entries.add_field("space directions",
                      fmt::format("{} {} {}", in_parentheses(directions[0]), in_parentheses(directions[1]),
                                  in_parentheses(directions[2])));
    if (geometry.has_origin) entries.add_field("space origin", in_parentheses(geometry.origin));
  } else if (geometry.has_spacing) {
    add_spacings(geometry.spacing, entries);
  }
  if (has_space || geometry.has_spacing)
    if (geometry.units != std::array<std::string, 3>{})
      entries.add_field(has_space ? "space units" : "units", in_quotes(geometry.units));
}

void add_spacings(const std::array<double, 3>& spacing, MetadataEntries& entries) {
  entries.add_field("spacings", fmt::format("{} {} {}", spacing[0], spacing[1], spacing[2]));
}

std::optional<std::vector<double>> vector_of(std::string_view value) {
  if (!value.starts_with('(') || !value.ends_with(')')) return std::nullopt;
  std::vector<double> numbers;
  for (const std::string_view part : split(value.substr(1, value.size() - 2), ',')) {
    const auto number = number_of(trimmed(part));
    if (!number) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

bool is_spatial_kind(std::string_view kind) {
  const std::string name = lower_case(kind);
  return name == "domain" || name == "space" || name == "none" || name == "???";
}

}  // namespace tagrid
