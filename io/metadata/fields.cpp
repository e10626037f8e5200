#include "io/metadata/fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "io/errors/errors.h"
#include "io/formats/nrrd/axes.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

using Vector = std::array<double, 3>;
using Fields = std::map<std::string_view, std::string_view>;

[[noreturn]] void refuse(const std::string& what) { throw BrokenInput("NRRD header: " + what); }

Fields fields_of(std::string_view nrrd_fields) {
  Fields fields;
  // Otherwise a header that contains these lines would not give them back.
  if (!nrrd_fields.empty() && (!nrrd_fields.ends_with('\n') || nrrd_fields.find("\r\n") != nrrd_fields.npos))
    refuse("lines here must end with a single line feed");
  for (const NrrdLine& line : nrrd_lines(nrrd_fields)) {
    if (line.kind != NrrdLine::Kind::field) continue;
    if (is_storage_field(line.field)) refuse(std::string(line.field) + " is not expected here");
    if (!fields.emplace(line.field, line.value).second) refuse(std::string(line.field) + " is given twice");
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

Geometry geometry_of(std::string_view nrrd_fields) {
  const Fields fields = fields_of(nrrd_fields);
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

VolumeInfo volume_info(const Index3& dims, SampleType type, std::string nrrd_fields) {
  Geometry geometry = geometry_of(nrrd_fields);
  return {dims, type, std::move(geometry), std::move(nrrd_fields)};
}

namespace {

std::string in_parentheses(const Vector& v) { return fmt::format("({},{},{})", v[0], v[1], v[2]); }

std::string units_line(std::string_view field, const std::array<std::string, 3>& units) {
  std::string line = fmt::format("{}:", field);
  for (const std::string& unit : units) {
    line += " \"";
    for (const char c : unit)
      if (c == '"' || c == '\\')
        line += {'\\', c};
      else if (static_cast<unsigned char>(c) >= ' ')
        line += c;
    line += '"';
  }
  return line + '\n';
}

std::string pair_line(std::string_view key, std::string_view value) {
  std::string line;
  for (const char c : key) {
    const bool is_plain = (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') ||
                          std::string_view(" .,-+/()_").find(c) != std::string_view::npos;
    line += is_plain ? c : '_';
  }
  if (line.empty()) line.push_back('_');
  line += ":=";
  for (const char c : value)
    if (c == '\n')
      line += "\\n";
    else if (c == '\\')
      line += "\\\\";
    else if (c != '\r' && c != '\0')
      line += c;
  return line + '\n';
}

}  // namespace

void add_rescale(const Rescale& rescale, KeyValues& pairs) {
  if (rescale.slope == 1 && rescale.intercept == 0) return;
  pairs.emplace_back("rescale_slope", fmt::format("{}", rescale.slope));
  pairs.emplace_back("rescale_intercept", fmt::format("{}", rescale.intercept));
  if (!rescale.units.empty()) pairs.emplace_back("rescale_units", rescale.units);
}

std::string nrrd_fields_of(const Geometry& geometry, const KeyValues& pairs) {
  std::string lines;
  // A space says what vectors mean: without vectors, only spacings can be said.
  const bool has_space = geometry.has_directions || geometry.has_origin;
  if (has_space) {
    auto directions = geometry.directions;
    if (!geometry.has_directions)
      for (std::size_t axis = 0; axis < 3; ++axis) directions[axis][axis] = spacing_or_1(geometry, axis);
    lines += geometry.space.empty() ? std::string("space dimension: 3\n")
                                    : fmt::format("space: {}\n", geometry.space);
    lines += fmt::format("space directions: {} {} {}\n", in_parentheses(directions[0]),
                         in_parentheses(directions[1]), in_parentheses(directions[2]));
    if (geometry.has_origin) lines += fmt::format("space origin: {}\n", in_parentheses(geometry.origin));
  } else if (geometry.has_spacing) {
    lines += spacings_line(geometry.spacing);
  }
  if (has_space || geometry.has_spacing)
    if (geometry.units != std::array<std::string, 3>{})
      lines += units_line(has_space ? "space units" : "units", geometry.units);
  for (const auto& [key, value] : pairs) lines += pair_line(key, value);
  return lines;
}

std::string spacings_line(const std::array<double, 3>& spacing) {
  return fmt::format("spacings: {} {} {}\n", spacing[0], spacing[1], spacing[2]);
}

}  // namespace tagrid
