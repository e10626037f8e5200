// VFF of Sun, as micro-CT scanners of GE write it: "ncaa", lines of names and values, a form feed, and big-endian
// samples.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

#include "io/errors/errors.h"
#include "io/formats/vendors/vendors.h"
#include "io/metadata/foreign_geometry.h"
#include "io/metadata/rescale.h"
#include "io/samples/file_samples.h"
#include "io/text/fields.h"
#include "io/text/foreign_number.h"
#include "io/text/text.h"
#include "io/volume/given_spacing.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {
namespace {

[[noreturn]] void refuse(const std::string& file, const char* name, std::string_view value,
                         std::string_view why) {
  throw BrokenInput("{}: {} {}: {}", file, name, quoted(value), why);
}

void require(const std::string& file, const TextFields& fields, const char* name, std::string_view value) {
  const auto stated = field_of(fields, name);
  if (stated && lower_case(*stated) != value)
    refuse(file, name, *stated, fmt::format("only {} is supported", value));
}

Index3 dims_of(const std::string& file, const TextFields& fields) {
  const std::string_view text = field_of(fields, "size").value_or("");
  const auto words = words_of(text);
  std::array<std::int64_t, 3> sizes = {};
  if (words.size() != 3) refuse(file, "size", text, "must be three numbers");
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto size = whole_number_of(words[axis]);
    if (!size || *size < 1) refuse(file, "size", text, "must be three positive numbers");
    sizes[axis] = *size;
  }
  return {sizes[0], sizes[1], sizes[2]};
}

SampleType type_of(const std::string& file, const TextFields& fields, SourceFacts& facts) {
  const std::string_view bits = field_of(fields, "bits").value_or("");
  if (bits == "8") return SampleType::uint8;
  if (bits == "16") return SampleType::int16;
  if (bits != "32") refuse(file, "bits", bits, "only 8, 16 and 32 are supported");
  facts.not_understood.push_back(fmt::format(
      "{}: does not state whether its samples of 32 bits are floats; they are read as floats", file));
  return SampleType::float32;
}

/// The distances are spacing times elementsize, in mm if there is an elementsize.
Geometry geometry_of(const std::string& file, const TextFields& fields, SourceFacts& facts) {
  const ForeignNumber element = foreign_number(field_of(fields, "elementsize"));
  const ForeignNumbers spacing = foreign_numbers(field_of(fields, "spacing"), 3),
                       origin = foreign_numbers(field_of(fields, "origin"), 3);
  Geometry geometry;
  const auto note = [&](const std::string& remark) {
    if (!remark.empty()) facts.warnings.push_back(fmt::format("{}: {}", file, remark));
  };
  note(remark_on(element, "elementsize", "spacing is unknown"));
  note(remark_on(origin, "origin", "where the volume lies is unknown"));
  const bool has_numbers = spacing.numbers.size() == 3;
  if (!has_numbers) note(remark_on(spacing, "spacing", "spacing is unknown"));
  if (element.is_unreadable() || (!has_numbers && !spacing.is_absent)) return geometry;
  if (element.is_absent() && spacing.is_absent) return geometry;
  const double size = element.value_or(1);
  std::vector<ForeignNumber> distances(3, foreign_number(size));
  if (has_numbers) distances = spacing.numbers;
  for (ForeignNumber& distance : distances)
    if (has_numbers) distance.value *= size;
  set_spacing(distances, {fmt::format("{}: {}", file, has_numbers ? "spacing" : "elementsize")},
              NegativeSpacing::is_unknown, geometry, facts.warnings);
  if (element.is_number()) geometry.units.fill("mm");
  if (has_unknown_spacing(geometry) || !origin.are_numbers()) return geometry;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    geometry.directions[axis][axis] = geometry.spacing[axis];
    geometry.origin[axis] = size * origin.numbers[axis].value;
  }
  geometry.has_directions = geometry.has_origin = true;
  return geometry;
}

Rescale rescale_of(const std::string& file, const TextFields& fields, SourceFacts& facts) {
  const auto number = [&](const char* name, double otherwise) {
    const ForeignNumber value = foreign_number(field_of(fields, name));
    if (value.is_unreadable())
      facts.scale_doubt =
          fmt::format("{}: {}", file, remark_on(value, name, "what values samples mean is unknown"));
    return value.value_or(otherwise);
  };
  const Rescale rescale{number("data_scale", 1), number("data_offset", 0), ""};
  if (rescale.slope != 0) return rescale;
  facts.scale_doubt = file + ": data_scale is 0; what values samples mean is unknown";
  return {};
}

}  // namespace

std::unique_ptr<VolumeSource> open_vff(std::unique_ptr<FileBytes> file, const std::string& path,
                                       const SourceDescription&) {
  const std::string name = file->name();
  const std::string_view beginning = file->peek(FileBytes::peek_limit);
  const std::size_t end = beginning.find("\f\n");
  if (end == beginning.npos)
    throw BrokenInput("{}: its header does not end within {} bytes", name,
                      std::min(beginning.size(), FileBytes::peek_limit));
  const TextFields fields =
      fields_between_semicolons(beginning.substr(vff_magic.size(), end - vff_magic.size()));
  require(name, fields, "rank", "3");
  require(name, fields, "type", "raster");
  require(name, fields, "format", "slice");
  require(name, fields, "bands", "1");
  SourceFacts facts;
  facts.files = {path};
  const Index3 dims = dims_of(name, fields);
  const SampleType type = type_of(name, fields, facts);
  if (!sample_bytes(dims, type) || !is_volume_size(dims))
    throw BrokenInput("{}: a volume cannot have {} samples", name, described(dims, type));
  const Geometry geometry = geometry_of(name, fields, facts);
  facts.rescale = rescale_of(name, fields, facts);
  KeyValues pairs;
  add_rescale(facts.rescale, pairs);
  for (const auto& [key, value] : fields)
    if (!key.empty() && !value.empty()) pairs.emplace_back("vff_" + key, value);
  facts.info = {dims, type, Metadata(geometry, pairs)};
  facts.holds_other_bytes = true;
  facts.missing_of_voxel_size = missing_of_voxel_size(geometry, true);
  SamplesPlace place{.start = end + 2, .big_endian = true};
  allow_more(*file, place, facts);
  return plain_samples(std::move(facts), std::move(file), place);
}

}  // namespace tagrid
