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
  if (!line.empty() && line.front() == '#') return {};
  if (line.find('\0') != line.npos) throw BrokenInput("NRRD header: a line contains a zero byte");
  const std::size_t colon = line.find(':');
  if (colon != line.npos && line.substr(colon, 2) != ":=") {
    const std::string_view field = field_named(line.substr(0, colon));
    if (!field.empty()) return {NrrdLine::Kind::field, field, trimmed(line.substr(colon + 1))};
  }
  // A key may contain a colon, but not ":=".
  if (line.find(":=") != line.npos) return {NrrdLine::Kind::key_value, {}, {}};
  throw BrokenInput("NRRD header: the line " + quoted(line) +
                    " is neither a field, a key:=value nor a comment");
}

bool is_storage_field(std::string_view field) {
  return std::any_of(storage_fields.begin(), storage_fields.end(),
                     [&](const FieldName& f) { return f.field == field; });
}

}  // namespace tagrid
