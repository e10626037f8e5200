#include "io/volume/given_spacing.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "io/errors/errors.h"
#include "io/metadata/fields.h"
#include "io/metadata/lengths.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

using Distances = std::array<double, 3>;

/// Programs round their numbers: 0.01 mm may be 9.99999e-3.
constexpr double rounding = 1e-6;

/// "10 10 25 um"; a distance that is not known is `unknown`.
std::string text_of_spacing(const Distances& distances, std::string_view unit,
                            std::string_view unknown = "unknown") {
  std::string text;
  for (const double distance : distances) {
    if (!text.empty()) text += ' ';
    text += std::isnan(distance) ? std::string(unknown) : fmt::format("{}", distance);
  }
  return text.append(unit.empty() ? "" : " ").append(unit);
}

/// Distances without the signs of axes that run the other way.
Distances distances_of(const Geometry& geometry) {
  Distances distances = geometry.spacing;
  for (double& distance : distances) distance = std::abs(distance);
  return distances;
}

/// A length in the unit of `geometry`, if both units are known and differ.
double in_unit_of(const Geometry& geometry, double length, std::string_view unit) {
  const auto from = length_unit(unit), to = length_unit(common_unit(geometry).name);
  return from && to ? converted(length, *from, *to) : length;
}

bool is_near(double a, double b, double tolerance) {
  return std::abs(a - b) <= tolerance * std::max(std::abs(a), std::abs(b));
}

/// True if the spacing along no axis contradicts `given`.
bool agrees(const Geometry& geometry, const GivenSpacing& given) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (!std::isnan(geometry.spacing[axis]) &&
        !is_near(std::abs(geometry.spacing[axis]), in_unit_of(geometry, given.distances[axis], given.unit),
                 rounding))
      return false;
  return true;
}

bool has_unit(const Geometry& geometry) { return geometry.units != std::array<std::string, 3>{}; }

bool is_complete(const Geometry& geometry, const GivenSpacing& given) {
  return geometry.has_spacing && !has_unknown_spacing(geometry) && (given.unit.empty() || has_unit(geometry));
}

/// True if lengths of this geometry, also those of an origin without any spacing, are in known units.
bool has_known_units(const Geometry& geometry) {
  return common_unit(geometry).is_known || std::ranges::all_of(geometry.units, [](const std::string& unit) {
           return length_unit(unit).has_value();
         });
}

/// The geometry with the given distances, in the given unit as far as units are known. The origin
/// stays where it is.
Geometry with_spacing(const Geometry& before, const GivenSpacing& given) {
  const bool is_converted = !given.unit.empty() && has_known_units(before);
  Geometry geometry = is_converted ? in_unit(before, given.unit) : before;
  if (!given.unit.empty()) geometry.units.fill(given.unit);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double was = geometry.spacing[axis], distance = given.distances[axis];
    geometry.spacing[axis] = std::isnan(was) ? distance : std::copysign(distance, was);
    if (geometry.has_directions)
      for (double& part : geometry.directions[axis]) part *= distance / was;
  }
  geometry.has_spacing = true;
  return geometry;
}

/// The description with this geometry and these pairs, and all other entries of `before`. Positions of slices
/// are kept if `keeps_positions`.
Metadata metadata_with(const Geometry& geometry, const Metadata& before, const KeyValues& pairs,
                       bool keeps_positions) {
  std::vector<std::string_view> fields = {"spacings", "units", "axis mins", "axis maxs"}, keys;
  if (geometry.has_directions || geometry.has_origin)
    fields.insert(fields.end(),
                  {"space", "space dimension", "space directions", "space origin", "space units"});
  for (const auto& [key, value] : pairs) keys.push_back(key);
  if (!keeps_positions) keys.emplace_back("slice_positions");
  MetadataEntries entries;
  add_fields(geometry, entries);
  for (const MetadataEntry& entry : before.entries()) {
    const bool is_pair = entry.kind == MetadataEntry::Kind::pair,
               is_field = entry.kind == MetadataEntry::Kind::field;
    if (is_field && std::ranges::find(fields, entry.field) != fields.end()) continue;
    if (is_pair && std::ranges::find(keys, entry.key) != keys.end()) continue;
    entries.add(entry);
  }
  for (const auto& [key, text] : pairs) entries.add_pair(key, text);
  return Metadata(std::move(entries));
}

std::string in_words(const Geometry& geometry) {
  return text_of_spacing(distances_of(geometry), common_unit(geometry).name);
}

/// The spacing as overridden_spacing_key records it.
std::string recorded(const Geometry& geometry) {
  return text_of_spacing(distances_of(geometry), common_unit(geometry).name, "nan");
}

/// True if `text`, as recorded() writes it, is the spacing of `geometry`.
bool is_spacing_of(const Geometry& geometry, std::string_view text) {
  const auto words = words_of(text);
  const auto from = length_unit(common_unit(geometry).name),
             to = length_unit(words.size() > 3 ? words[3] : std::string_view());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double was = axis < words.size() ? number_of(words[axis]).value_or(Geometry::unknown) : 0;
    double is = std::abs(geometry.spacing[axis]);
    if (from && to) is = converted(is, *from, *to);
    // Other formats may have numbers of 32 bits.
    constexpr double of_other_formats = 1e-5;
    if (std::isnan(was) != std::isnan(is) || (!std::isnan(is) && !is_near(was, is, of_other_formats)))
      return false;
  }
  return true;
}

}  // namespace

void give_spacing(VolumeSource& volume, const GivenSpacing& given) {
  const Metadata& metadata = volume.info().metadata;
  const Geometry before = in_one_unit(metadata.geometry());
  const std::string text = text_of_spacing(given.distances, given.unit);
  const bool is_same = agrees(before, given);
  if (!is_same && !given.overrides)
    throw UsageError(
        "{}: states the spacing {}, but {} is {}; leave it out, or use {} to replace what "
        "the file states",
        volume.name(), in_words(before), Setting{"spacing", "the given spacing"}, text,
        Setting{"override-spacing", "a spacing that overrides it"});
  if (is_same && is_complete(before, given)) return;
  const Geometry after = with_spacing(before, given);
  KeyValues pairs;
  if (!volume.facts().headerless) pairs.emplace_back(given_spacing_key, text);
  if (!is_same) {
    pairs.emplace_back(overridden_spacing_key, recorded(before));
    std::string warning =
        fmt::format("{}: its spacing {} is replaced by {}", volume.name(), in_words(before), text);
    if (!metadata.text_of("slice_positions").empty())
      warning += "; the positions of its slices contradict the new spacing, and are left out";
    if (before.has_origin && !given.unit.empty() && !has_known_units(before))
      warning += fmt::format("; the unit of its origin is unknown, so {} is assumed", given.unit);
    volume.add_warning(std::move(warning));
  }
  volume.set_metadata(metadata_with(after, metadata, pairs, is_same));
}

Metadata with_overridden_spacing(const Metadata& original, const Metadata& ours) {
  const std::string overridden = ours.text_of(overridden_spacing_key);
  const Geometry before = in_one_unit(original.geometry());
  if (overridden.empty() || original.text_of(overridden_spacing_key) == overridden ||
      !is_spacing_of(before, overridden))
    return original;
  const Geometry& geometry = ours.geometry();
  return metadata_with(with_spacing(before, {distances_of(geometry), common_unit(geometry).name, true}),
                       original, {}, false);
}

std::string missing_of_voxel_size(const Geometry& geometry, bool needs_unit) {
  if (!geometry.has_spacing && !geometry.has_directions) return "its voxel size is not stated";
  std::string unknown;
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (std::isnan(geometry.spacing[axis]))
      unknown += (unknown.empty() ? "" : ", ") + std::string(1, "xyz"[axis]);
  if (unknown == "z") return "the distance between its slices is not stated";
  if (!unknown.empty()) return fmt::format("its spacing along {} is not stated", unknown);
  return needs_unit && !has_unit(geometry) ? "its voxel size has no unit" : "";
}

}  // namespace tagrid
