#include "io/nrrd/line.h"

#include <algorithm>
#include <array>
#include <charconv>

#include "io/files/errors.h"

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

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
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

std::string_view take_line(std::string_view& text) {
  const std::size_t end = text.find('\n');
  std::string_view line = text.substr(0, end);
  text.remove_prefix(end == text.npos ? text.size() : end + 1);
  while (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> words;
  constexpr std::string_view blanks = " \t";
  for (std::size_t begin = text.find_first_not_of(blanks); begin != text.npos;) {
    const std::size_t end = std::min(text.find_first_of(blanks, begin), text.size());
    words.push_back(text.substr(begin, end - begin));
    begin = text.find_first_not_of(blanks, end);
  }
  return words;
}

std::optional<double> number_of(std::string_view text) {
  if (text.starts_with("+")) text.remove_prefix(1);
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

std::string quoted(std::string_view text) {
  std::string result = "\"";
  for (char c : text.substr(0, 60)) result += c >= 32 && c < 127 ? c : '?';
  return result + (text.size() > 60 ? "...\"" : "\"");
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return lower;
}

}  // namespace tagrid
