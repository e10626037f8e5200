#include "io/formats/nrrd/axes.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "io/errors/errors.h"
#include "io/metadata/fields.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

using Values = std::vector<std::string_view>;

/// A field with a value for each axis.
struct AxisField {
  std::string_view name;
  enum class Values { words, quoted, vectors } values;
  std::string_view unknown;  ///< the value for an axis of which nothing is known
};

constexpr std::array axis_fields = {AxisField{"spacings", AxisField::Values::words, "nan"},
                                    AxisField{"thicknesses", AxisField::Values::words, "nan"},
                                    AxisField{"axis mins", AxisField::Values::words, "nan"},
                                    AxisField{"axis maxs", AxisField::Values::words, "nan"},
                                    AxisField{"centers", AxisField::Values::words, "???"},
                                    AxisField{"kinds", AxisField::Values::words, "???"},
                                    AxisField{"labels", AxisField::Values::quoted, "\"\""},
                                    AxisField{"units", AxisField::Values::quoted, "\"\""},
                                    AxisField{"space directions", AxisField::Values::vectors, "none"}};

const AxisField* axis_field(std::string_view name) {
  const auto found = std::ranges::find(axis_fields, name, &AxisField::name);
  return found == axis_fields.end() ? nullptr : &*found;
}

/// The length of the text in quotes, or of the vector or word, with which `rest` begins. 0 if it does not
/// end.
std::size_t length_of_value(AxisField::Values kind, std::string_view rest) {
  const auto of_word = [&] { return std::min(rest.find_first_of(" \t"), rest.size()); };
  const auto until = [](std::size_t last) { return last == std::string_view::npos ? 0 : last + 1; };
  if (kind == AxisField::Values::words) return of_word();
  if (kind == AxisField::Values::vectors) return rest[0] == '(' ? until(rest.find(')')) : of_word();
  if (rest[0] != '"') return 0;
  for (std::size_t i = 1; i < rest.size(); ++i)
    if (rest[i] == '\\')
      ++i;
    else if (rest[i] == '"')
      return i + 1;
  return 0;
}

Values values_of(const AxisField& field, std::string_view value, std::size_t axes) {
  Values values;
  for (std::string_view rest = trimmed(value); !rest.empty(); rest = trimmed(rest)) {
    const std::size_t length = length_of_value(field.values, rest);
    if (length == 0) break;
    values.push_back(rest.substr(0, length));
    rest.remove_prefix(length);
    if (rest.empty() && values.size() == axes) return values;
  }
  throw BrokenInput(fmt::format("NRRD header: {}: {} must have a value for each of the {} axes", field.name,
                                quoted(value), axes));
}

std::string text_of(const std::vector<double>& v) { return fmt::format("({})", fmt::join(v, ",")); }

/// The directions of a slice, and a third one. In a plane, vectors get a third coordinate.
std::string directions_of_slice(const Values& values) {
  auto a = vector_of(values[0]), b = vector_of(values[1]);
  if (!a || !b || a->size() != b->size() || (a->size() != 2 && a->size() != 3))
    return fmt::format("{} none", fmt::join(values, " "));  // is refused as it is
  a->resize(3);
  b->resize(3);
  const std::vector<double>&u = *a, &v = *b;
  std::vector<double> normal = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                                u[0] * v[1] - u[1] * v[0]};
  const double length = std::sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
  if (length > 0)
    for (double& n : normal) n = n / length + 0.0;  // not -0
  return fmt::format("{} {} {}", text_of(u), text_of(v), text_of(normal));
}

std::string field_of_slice(const NrrdLine& line) {
  if (line.field == "space dimension") return "3";
  if (line.field == "space origin") {
    auto origin = vector_of(line.value);
    if (!origin || origin->size() != 2) return std::string(line.value);
    origin->push_back(std::isnan((*origin)[0]) ? (*origin)[0] : 0);
    return text_of(*origin);
  }
  const AxisField* field = axis_field(line.field);
  if (field == nullptr) return std::string(line.value);
  const Values values = values_of(*field, line.value, 2);
  if (field->values == AxisField::Values::vectors) return directions_of_slice(values);
  return fmt::format("{} {}", fmt::join(values, " "), field->unknown);
}

/// Which axes remain, by their numbers.
std::vector<std::size_t> axes_of_volume(const std::vector<std::int64_t>& sizes,
                                        std::string_view nrrd_fields) {
  std::vector<std::size_t> single;  // the fastest axis, and then the slowest first
  for (std::size_t axis = sizes.size(); axis-- > 0;)
    if (sizes[axis] == 1) single.insert(axis == 0 ? single.begin() : single.end(), axis);
  if (single.size() + 3 < sizes.size())
    throw BrokenInput(fmt::format(
        "NRRD header: sizes: {}: a volume has 3 axes, and this file has {} with more than one sample, for "
        "components (colors, vectors) or time points; extract one of them first, for example with unu slice",
        fmt::join(sizes, " "), sizes.size() - single.size()));
  std::vector<bool> is_in_space(sizes.size(), true);
  for (const NrrdLine& line : nrrd_lines(nrrd_fields)) {
    if (line.field != "kinds" && line.field != "space directions") continue;
    const Values values = values_of(*axis_field(line.field), line.value, sizes.size());
    for (std::size_t axis = 0; axis < sizes.size(); ++axis) {
      const bool is_none = lower_case(values[axis]) == "none";
      if (line.field == "kinds" ? !is_spatial_kind(values[axis]) : is_none) is_in_space[axis] = false;
    }
  }
  std::ranges::stable_sort(single, {}, [&](std::size_t axis) { return is_in_space[axis] ? 1 : 0; });
  single.resize(sizes.size() - 3);
  std::vector<std::size_t> axes;
  for (std::size_t axis = 0; axis < sizes.size(); ++axis)
    if (std::ranges::find(single, axis) == single.end()) axes.push_back(axis);
  return axes;
}

/// The header lines, with new values where `value_of` gives some.
template <class ValueOf>
std::string changed(std::string_view nrrd_fields, ValueOf value_of) {
  std::string lines;
  for (const NrrdLine& line : nrrd_lines(nrrd_fields)) {
    const std::string value = line.kind == NrrdLine::Kind::field ? value_of(line) : "";
    if (line.kind == NrrdLine::Kind::field && value != line.value)
      lines += fmt::format("{}: {}\n", line.field, value);
    else
      lines.append(line.text).append("\n");
  }
  return lines;
}

}  // namespace

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

std::optional<std::vector<std::string_view>> vectors_in(std::string_view value) {
  std::vector<std::string_view> vectors;
  for (std::string_view rest = trimmed(value); !rest.empty(); rest = trimmed(rest)) {
    const std::size_t length = length_of_value(AxisField::Values::vectors, rest);
    if (length == 0) return std::nullopt;
    vectors.push_back(rest.substr(0, length));
    rest.remove_prefix(length);
  }
  return vectors;
}

bool is_spatial_kind(std::string_view kind) {
  const std::string name = lower_case(kind);
  return name == "domain" || name == "space" || name == "none" || name == "???";
}

ThreeAxes three_axes(const std::vector<std::int64_t>& sizes, std::string_view nrrd_fields) {
  if (sizes.size() == 2) return {{sizes[0], sizes[1], 1}, changed(nrrd_fields, field_of_slice)};
  if (sizes.size() == 3) return {{sizes[0], sizes[1], sizes[2]}, std::string(nrrd_fields)};
  const std::vector<std::size_t> axes = axes_of_volume(sizes, nrrd_fields);
  const auto of_axes = [&](const NrrdLine& line) {
    const AxisField* field = axis_field(line.field);
    if (field == nullptr) return std::string(line.value);
    const Values values = values_of(*field, line.value, sizes.size());
    return fmt::format("{} {} {}", values[axes[0]], values[axes[1]], values[axes[2]]);
  };
  return {{sizes[axes[0]], sizes[axes[1]], sizes[axes[2]]}, changed(nrrd_fields, of_axes)};
}

std::string with_spacing_of_ends(const std::string& nrrd_fields, const Index3& dims) {
  std::map<std::string_view, std::vector<std::string_view>> words;
  std::string others;  // all lines but the spacings
  for (const NrrdLine& line : nrrd_lines(nrrd_fields)) {
    words[line.field] = words_of(line.value);
    if (line.field != "spacings") others.append(line.text).append("\n");
  }
  const auto &mins = words["axis mins"], &maxs = words["axis maxs"], &centers = words["centers"];
  const Geometry geometry = geometry_of(nrrd_fields);
  if (mins.size() != 3 || maxs.size() != 3 || geometry.has_directions) return nrrd_fields;
  std::array<double, 3> spacing = geometry.spacing;
  bool has_more = false;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!std::isnan(spacing[axis])) continue;
    const auto low = number_of(mins[axis]), high = number_of(maxs[axis]);
    const bool is_node = centers.size() == 3 && lower_case(centers[axis]) == "node";
    const auto steps = dims[static_cast<int>(axis)] - (is_node ? 1 : 0);
    if (!low || !high || steps == 0) continue;
    const double step = (*high - *low) / static_cast<double>(steps);
    if (!std::isfinite(step) || step == 0) continue;
    spacing[axis] = step;
    has_more = true;
  }
  return has_more ? others + spacings_line(spacing) : nrrd_fields;
}

}  // namespace tagrid
