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
  throw BrokenInput("NRRD header: {}: {} must have a value for each of the {} axes", field.name,
                    quoted(value), axes);
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

std::string field_of_slice(const MetadataEntry& entry) {
  if (entry.field == "space dimension") return "3";
  if (entry.field == "space origin") {
    auto origin = vector_of(entry.value);
    if (!origin || origin->size() != 2) return std::string(entry.value);
    origin->push_back(std::isnan((*origin)[0]) ? (*origin)[0] : 0);
    return text_of(*origin);
  }
  const AxisField* field = axis_field(entry.field);
  if (field == nullptr) return std::string(entry.value);
  const Values values = values_of(*field, entry.value, 2);
  if (field->values == AxisField::Values::vectors) return directions_of_slice(values);
  return fmt::format("{} {}", fmt::join(values, " "), field->unknown);
}

/// Which axes remain, by their numbers.
std::vector<std::size_t> axes_of_volume(const std::vector<std::int64_t>& sizes,
                                        const MetadataEntries& entries) {
  std::vector<std::size_t> single;  // the fastest axis, and then the slowest first
  for (std::size_t axis = sizes.size(); axis-- > 0;)
    if (sizes[axis] == 1) single.insert(axis == 0 ? single.begin() : single.end(), axis);
  if (single.size() + 3 < sizes.size())
    throw BrokenInput(
        "NRRD header: sizes: {}: a volume has 3 axes, and this file has {} with more than one sample, for "
        "components (colors, vectors) or time points; extract one of them first, for example with unu slice",
        fmt::join(sizes, " "), sizes.size() - single.size());
  std::vector<bool> is_in_space(sizes.size(), true);
  for (const MetadataEntry& entry : entries) {
    if (entry.field != "kinds" && entry.field != "space directions") continue;
    const Values values = values_of(*axis_field(entry.field), entry.value, sizes.size());
    for (std::size_t axis = 0; axis < sizes.size(); ++axis) {
      const bool is_none = lower_case(values[axis]) == "none";
      if (entry.field == "kinds" ? !is_spatial_kind(values[axis]) : is_none) is_in_space[axis] = false;
    }
  }
  std::ranges::stable_sort(single, {}, [&](std::size_t axis) { return is_in_space[axis] ? 1 : 0; });
  single.resize(sizes.size() - 3);
  std::vector<std::size_t> axes;
  for (std::size_t axis = 0; axis < sizes.size(); ++axis)
    if (std::ranges::find(single, axis) == single.end()) axes.push_back(axis);
  return axes;
}

/// The entries, with new values where `value_of` gives some.
template <class ValueOf>
MetadataEntries changed(const MetadataEntries& entries, ValueOf value_of) {
  MetadataEntries result;
  for (const MetadataEntry& entry : entries) {
    const std::string value = entry.kind == MetadataEntry::Kind::field ? value_of(entry) : "";
    if (entry.kind == MetadataEntry::Kind::field && value != entry.value)
      result.add_field(entry.field, value);
    else
      result.add(entry);
  }
  return result;
}

}  // namespace

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

ThreeAxes three_axes(const std::vector<std::int64_t>& sizes, const MetadataEntries& entries) {
  if (sizes.size() == 2) return {{sizes[0], sizes[1], 1}, changed(entries, field_of_slice)};
  if (sizes.size() == 3) return {{sizes[0], sizes[1], sizes[2]}, entries};
  const std::vector<std::size_t> axes = axes_of_volume(sizes, entries);
  const auto of_axes = [&](const MetadataEntry& entry) {
    const AxisField* field = axis_field(entry.field);
    if (field == nullptr) return std::string(entry.value);
    const Values values = values_of(*field, entry.value, sizes.size());
    return fmt::format("{} {} {}", values[axes[0]], values[axes[1]], values[axes[2]]);
  };
  return {{sizes[axes[0]], sizes[axes[1]], sizes[axes[2]]}, changed(entries, of_axes)};
}

Metadata with_spacing_of_ends(const Metadata& metadata, const Index3& dims) {
  std::map<std::string_view, std::vector<std::string_view>> words;
  MetadataEntries entries;  // all but the spacings
  for (const MetadataEntry& entry : metadata.entries()) {
    words[entry.field] = words_of(entry.value);
    if (entry.field != "spacings") entries.add(entry);
  }
  const auto &mins = words["axis mins"], &maxs = words["axis maxs"], &centers = words["centers"];
  const Geometry& geometry = metadata.geometry();
  if (mins.size() != 3 || maxs.size() != 3 || geometry.has_directions) return metadata;
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
  if (!has_more) return metadata;
  add_spacings(spacing, entries);
  return Metadata(std::move(entries));
}

}  // namespace tagrid
