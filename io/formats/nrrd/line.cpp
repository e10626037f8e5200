#include "io/formats/nrrd/line.h"

#include <algorithm>
#include <array>
#include <charconv>

#include "io/errors/errors.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

struct FieldName {
  std::string_view spelling, field;
};

constexpr std::array storage_fields = {
    FieldName{"type", "type"},          FieldName{"dimension", "dimension"},
    FieldName{"sizes", "sizes"},        FieldName{"encoding", "encoding"},
    FieldName{"endian", "endian"},      FieldName{"data file", "data file"},
    FieldName{"datafile", "data file"}, FieldName{"line skip", "line skip"},
    FieldName{"lineskip", "line skip"}, FieldName{"byte skip", "byte skip"},
    FieldName{"byteskip", "byte skip"}};

constexpr std::array other_fields = {FieldName{"content", "content"},
                                     FieldName{"number", "number"},
                                     FieldName{"block size", "block size"},
                                     FieldName{"blocksize", "block size"},
                                     FieldName{"min", "min"},
                                     FieldName{"max", "max"},
                                     FieldName{"old min", "old min"},
                                     FieldName{"oldmin", "old min"},
                                     FieldName{"old max", "old max"},
                                     FieldName{"oldmax", "old max"},
                                     FieldName{"sample units", "sample units"},
                                     FieldName{"sampleunits", "sample units"},
                                     FieldName{"spacings", "spacings"},
                                     FieldName{"thicknesses", "thicknesses"},
                                     FieldName{"axis mins", "axis mins"},
                                     FieldName{"axismins", "axis mins"},
                                     FieldName{"axis maxs", "axis maxs"},
                                     FieldName{"axismaxs", "axis maxs"},
                                     FieldName{"centers", "centers"},
                                     FieldName{"centerings", "centers"},
                                     FieldName{"labels", "labels"},
                                     FieldName{"units", "units"},
                                     FieldName{"kinds", "kinds"},
                                     FieldName{"space", "space"},
                                     FieldName{"space dimension", "space dimension"},
                                     FieldName{"space units", "space units"},
                                     FieldName{"space origin", "space origin"},
                                     FieldName{"space directions", "space directions"},
                                     FieldName{"measurement frame", "measurement frame"}};

std::string_view field_named(std::string_view name) {
  const std::string lower = lower_case(name);
  for (const FieldName& f : storage_fields)
    if (f.spelling == lower) return f.field;
  for (const FieldName& f : other_fields)
    if (f.spelling == lower) return f.field;
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
  return std::any_of(storage_fields.begin(), storage_fields.end(),
                     [&](const FieldName& f) { return f.field == field; });
}

std::vector<NrrdLine> nrrd_lines(std::string_view lines) {
  std::vector<NrrdLine> all;
  while (!lines.empty()) all.push_back(parse_nrrd_line(take_line(lines)));
  return all;
}

std::string text_of_key(std::string_view nrrd_fields, std::string_view key) {
  for (auto& [name, text] : key_values_of(nrrd_fields))
    if (name == key) return std::move(text);
  return "";
}

KeyValues key_values_of(std::string_view nrrd_fields) {
  KeyValues pairs;
  for (const NrrdLine& line : nrrd_lines(nrrd_fields)) {
    if (line.kind != NrrdLine::Kind::key_value) continue;
    std::string value;
    for (std::string_view rest = line.value; !rest.empty(); rest.remove_prefix(1)) {
      const bool is_escape = rest[0] == '\\' && rest.size() > 1 && (rest[1] == 'n' || rest[1] == '\\');
      if (is_escape) rest.remove_prefix(1);
      value += is_escape && rest[0] == 'n' ? '\n' : rest[0];
    }
    pairs.emplace_back(line.key, std::move(value));
  }
  return pairs;
}

std::string stripped(std::string_view nrrd_fields) {
  std::string kept;
  for (const NrrdLine& line : nrrd_lines(nrrd_fields)) {
    bool is_needed = line.kind == NrrdLine::Kind::field && line.field != "content" && line.field != "number";
    if (line.kind == NrrdLine::Kind::key_value)
      for (const std::string_view key :
           {"rescale_slope", "rescale_intercept", "rescale_units", "slice_positions", "slice_slopes",
            "slice_intercepts", "dicom_added_intercept", "applied_", "slice_applied_", "vdb_", "scale doubt",
            "not understood"})
        is_needed = is_needed || line.text.starts_with(key);
    if (is_needed) kept.append(line.text).append("\n");
  }
  return kept;
}

}  // namespace tagrid
