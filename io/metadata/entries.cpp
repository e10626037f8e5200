#include "io/metadata/entries.h"

#include <algorithm>
#include <array>
#include <map>
#include <span>

#include "io/errors/errors.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

/// A field, and another spelling of its name.
struct FieldName {
  std::string_view field, other = field;
};

constexpr std::array storage_fields = {FieldName{"type"},
                                       FieldName{"dimension"},
                                       FieldName{"sizes"},
                                       FieldName{"encoding"},
                                       FieldName{"endian"},
                                       FieldName{"data file", "datafile"},
                                       FieldName{"line skip", "lineskip"},
                                       FieldName{"byte skip", "byteskip"}};

constexpr std::array other_fields = {FieldName{"content"},
                                     FieldName{"number"},
                                     FieldName{"block size", "blocksize"},
                                     FieldName{"min"},
                                     FieldName{"max"},
                                     FieldName{"old min", "oldmin"},
                                     FieldName{"old max", "oldmax"},
                                     FieldName{"sample units", "sampleunits"},
                                     FieldName{"spacings"},
                                     FieldName{"thicknesses"},
                                     FieldName{"axis mins", "axismins"},
                                     FieldName{"axis maxs", "axismaxs"},
                                     FieldName{"centers", "centerings"},
                                     FieldName{"labels"},
                                     FieldName{"units"},
                                     FieldName{"kinds"},
                                     FieldName{"space"},
                                     FieldName{"space dimension"},
                                     FieldName{"space units"},
                                     FieldName{"space origin"},
                                     FieldName{"space directions"},
                                     FieldName{"measurement frame"}};

std::string_view field_named(std::string_view name) {
  const std::string lower = lower_case(name);
  for (const std::span<const FieldName> fields :
       {std::span<const FieldName>(storage_fields), std::span<const FieldName>(other_fields)})
    for (const FieldName& f : fields)
      if (f.field == lower || f.other == lower) return f.field;
  return {};
}

}  // namespace

NrrdLine parse_nrrd_line(std::string_view line) {
  if (!line.empty() && line.front() == '#') return {.text = line};
  if (line.find('\0') != line.npos) throw BrokenInput("NRRD header: a line contains a zero byte");
  const std::size_t colon = line.find(':');
  if (colon != line.npos && line.substr(colon, 2) != ":=") {
    const std::string_view field = field_named(line.substr(0, colon));
    if (!field.empty()) return {NrrdLine::Kind::field, field, trimmed(line.substr(colon + 1)), "", line};
  }
  // A key may contain a colon, but not ":=".
  if (const std::size_t sign = line.find(":="); sign != line.npos)
    return {NrrdLine::Kind::key_value, "", line.substr(sign + 2), line.substr(0, sign), line};
  throw BrokenInput("NRRD header: the line " + quoted(line) +
                    " is neither a field, a key:=value nor a comment");
}

bool is_storage_field(std::string_view field) {
  return std::ranges::find(storage_fields, field, &FieldName::field) != storage_fields.end();
}

NrrdLines::Iterator& NrrdLines::Iterator::operator++() {
  is_at_end_ = rest_.empty();
  if (!is_at_end_) line_ = parse_nrrd_line(take_line(rest_));
  return *this;
}

std::string text_of_key(std::string_view nrrd_fields, std::string_view key) {
  for (auto& [name, text] : key_values_of(nrrd_fields))
    if (name == key) return std::move(text);
  return "";
}

KeyValues key_values_of(std::string_view nrrd_fields) {
  KeyValues pairs;
  std::map<std::string_view, std::size_t> places;
  for (const NrrdLine& line : nrrd_lines(nrrd_fields)) {
    if (line.kind != NrrdLine::Kind::key_value) continue;
    std::string value;
    for (std::string_view rest = line.value; !rest.empty(); rest.remove_prefix(1)) {
      const bool is_escape = rest[0] == '\\' && rest.size() > 1 && (rest[1] == 'n' || rest[1] == '\\');
      if (is_escape) rest.remove_prefix(1);
      value += is_escape && rest[0] == 'n' ? '\n' : rest[0];
    }
    if (const auto [place, is_new] = places.try_emplace(line.key, pairs.size()); is_new)
      pairs.emplace_back(line.key, std::move(value));
    else
      pairs[place->second].second = std::move(value);
  }
  return pairs;
}

KeyValues pairs_without_places(std::string_view nrrd_fields) {
  KeyValues pairs = key_values_of(nrrd_fields);
  std::erase_if(pairs, [](const auto& pair) { return pair.first == "slice_positions"; });
  return pairs;
}

std::string stripped(std::string_view nrrd_fields) {
  std::string kept;
  for (const NrrdLine& line : nrrd_lines(nrrd_fields)) {
    bool is_needed = line.kind == NrrdLine::Kind::field && line.field != "content" && line.field != "number";
    if (line.kind == NrrdLine::Kind::key_value)
      for (const std::string_view key :
           {"rescale_slope", "rescale_intercept", "rescale_units", "slice_positions", "slice_slopes",
            "slice_intercepts", "dicom_added_intercept", "applied_", "slice_applied_", "vdb_", "lossy source",
            "scale doubt", "not understood", "given spacing", "overridden spacing"})
        is_needed = is_needed || line.text.starts_with(key);
    if (is_needed) kept.append(line.text).append("\n");
  }
  return kept;
}

}  // namespace tagrid
