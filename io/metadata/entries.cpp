#include "io/metadata/entries.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <span>

#include "io/errors/errors.h"
#include "io/text/text.h"

namespace tagrid {
namespace {

/// A field, and another spelling of its name.
struct FieldName {
  std::string_view field, other = field;
};

constexpr std::size_t storage_fields = 8;  // the first ones of the list
constexpr std::array known_fields = {FieldName{"type"},
                                     FieldName{"dimension"},
                                     FieldName{"sizes"},
                                     FieldName{"encoding"},
                                     FieldName{"endian"},
                                     FieldName{"data file", "datafile"},
                                     FieldName{"line skip", "lineskip"},
                                     FieldName{"byte skip", "byteskip"},
                                     FieldName{"content"},
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

/// The number of a field in the list; nothing if there is none of this name.
std::optional<std::size_t> field_named(std::string_view name) {
  const std::string lower = lower_case(name);
  for (std::size_t i = 0; i < known_fields.size(); ++i)
    if (known_fields[i].field == lower || known_fields[i].other == lower) return i;
  return std::nullopt;
}

}  // namespace

MetadataEntry entry_of_line(std::string_view line) {
  using enum MetadataEntry::Kind;
  if (!line.empty() && line.front() == '#') return {.line = line};
  if (line.find('\0') != line.npos) throw BrokenInput("NRRD header: a line contains a zero byte");
  const std::size_t colon = line.find(':');
  if (colon != line.npos && line.substr(colon, 2) != ":=")
    if (const auto number = field_named(line.substr(0, colon)))
      return {field, known_fields[*number].field, trimmed(line.substr(colon + 1)), "", line};
  // A key may contain a colon, but not ":=".
  if (const std::size_t sign = line.find(":="); sign != line.npos)
    return {pair, "", line.substr(sign + 2), line.substr(0, sign), line};
  throw BrokenInput("NRRD header: the line " + quoted(line) +
                    " is neither a field, a key:=value nor a comment");
}

bool is_storage_field(std::string_view field) {
  return std::ranges::any_of(std::span(known_fields).first(storage_fields),
                             [&](const FieldName& known) { return known.field == field; });
}

void MetadataEntries::add_field(std::string_view field, std::string_view value) {
  add_line(fmt::format("{}:{}{}", field, value.empty() ? "" : " ", value));
}

void MetadataEntries::add_pair(std::string_view key, std::string_view text) {
  std::string line;
  for (const char c : key) {
    const bool is_plain = (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') ||
                          std::string_view(" .,-+/()_").find(c) != std::string_view::npos;
    line += is_plain ? c : '_';
  }
  if (line.empty()) line.push_back('_');
  line += ":=";
  for (const char c : text)
    if (c == '\n')
      line += "\\n";
    else if (c == '\\')
      line += "\\\\";
    else if (c != '\r' && c != '\0')
      line += c;
  add_line(line);
}

void MetadataEntries::add_written_pair(std::string_view key, std::string_view value) {
  add_line(fmt::format("{}:={}", key, value));
}

void MetadataEntries::add_line(std::string_view line) {
  if (line.find('\n') != line.npos || line.ends_with('\r'))
    throw BrokenInput("NRRD header: lines here must end with a single line feed");
  entry_of_line(line);
  text_.append(line).append("\n");
}

}  // namespace tagrid
