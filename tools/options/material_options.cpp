#include "tools/options/material_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "io/errors/errors.h"
#include "io/files/file_bytes.h"
#include "io/text/text.h"
#include "tools/options/numbers.h"
#include "tools/options/shared_options.h"

namespace tagrid {
namespace {

constexpr std::string_view all_labels = "all";
constexpr std::uint64_t largest_file_of_names = std::uint64_t{16} << 20;

double number_in(const char* option, std::string_view text, const std::string& all) {
  const auto number = finite_number(std::string(text));
  if (!number) throw UsageError("{}: {}: '{}' is not a number", option, all, text);
  return *number;
}

// A name for sets of elements: other characters become underscores. `without_letters` is that of a name in Chinese.
std::string set_name(std::string_view name, const std::string& without_letters) {
  std::string result;
  for (const char c : name) {
    const bool is_kept = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if (is_kept || (!result.empty() && result.back() != '_')) result += is_kept ? c : '_';
  }
  while (!result.empty() && result.back() == '_') result.pop_back();
  if (result.empty()) return without_letters;
  if ((result[0] >= '0' && result[0] <= '9')) result.insert(0, "m_");
  return result;
}

// NAME=LOW:HIGH, where LOW or HIGH may be missing.
MaterialRange range_in(std::string_view text) {
  const std::string all(text);
  const std::size_t equals = text.find('='), colon = text.find(':', equals == text.npos ? 0 : equals);
  if (equals == text.npos || equals == 0 || colon == text.npos)
    throw UsageError("--materials: '{}' is not NAME=LOW:HIGH, such as bone=300: or soft=-200:300", all);
  const std::string_view name = text.substr(0, equals);
  MaterialRange range{set_name(name, std::string(name))};
  const std::string_view low = text.substr(equals + 1, colon - equals - 1), high = text.substr(colon + 1);
  if (!low.empty()) range.low = number_in("--materials", low, all);
  if (!high.empty()) range.high = number_in("--materials", high, all);
  return range;
}

void add_label(std::map<std::int64_t, std::string>& names, std::int64_t label, std::string_view name) {
  if (!names.emplace(label, set_name(name, fmt::format("label_{}", label))).second)
    throw UsageError("--labels: label {} has two names", label);
}

// The number and the name in a line of a table: CSV, a color table of 3D Slicer, or a description of labels of
// ITK-SNAP. Names between commas, semicolons or tabs may have blanks.
void add_line(std::map<std::int64_t, std::string>& names, std::string_view line, const std::string& where) {
  std::vector<std::string_view> fields;
  const bool has_quotes = line.find('"') != line.npos;
  const bool has_separators = line.find_first_of(",;\t") != line.npos && !has_quotes;
  const std::string_view between = has_separators ? "\t,;\r" : " \t,;\r";
  for (std::size_t i = line.find_first_not_of(between); i < line.size();) {
    const bool is_quoted = line[i] == '"';
    const std::size_t begin = is_quoted ? i + 1 : i;
    const std::size_t end =
        std::min(is_quoted ? line.find('"', begin) : line.find_first_of(between, begin), line.size());
    fields.push_back(line.substr(begin, end - begin));
    i = line.find_first_not_of(between, is_quoted ? end + 1 : end);
  }
  if (fields.empty() || fields[0].starts_with('#')) return;
  const auto label = whole_number<std::int64_t>(std::string(fields[0]));
  if (!label) {
    const auto has_digit = [](std::string_view field) {
      return field.find_first_of("0123456789") != field.npos;
    };
    if (names.empty() && !has_digit(fields[0])) return;  // the names of columns
    throw UsageError("--labels: {}: '{}' does not begin with the number of a label", where, line);
  }
  const auto is_name = [](std::string_view field) { return !finite_number(std::string(field)); };
  const auto name = std::find_if(fields.begin() + 1, fields.end(), is_name);
  if (name == fields.end()) throw UsageError("--labels: {}: label {} has no name", where, *label);
  // Between blanks, a name has all words up to the four numbers of a color, or up to the next number.
  auto end = name + 1;
  if (!has_separators && !has_quotes) {
    const bool has_color = fields.end() - name > 4 && std::none_of(fields.end() - 4, fields.end(), is_name);
    end = has_color ? fields.end() - 4 : std::find_if_not(name, fields.end(), is_name);
  }
  add_label(names, *label, fmt::format("{}", fmt::join(name, end, " ")));
}

std::string text_of(const std::string& path) {
  const FileSource file(path);
  if (file.size() > largest_file_of_names)
    throw UsageError("--labels: {}: is too large for a list of names", path);
  std::string text(file.size(), '\0');
  file.read_at(0, std::as_writable_bytes(std::span(text)));
  constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";
  if (text.starts_with(byte_order_mark)) text.erase(0, byte_order_mark.size());
  return text;
}

std::map<std::int64_t, std::string> label_names(const std::string& text) {
  std::map<std::int64_t, std::string> names;
  if (text == all_labels) return names;
  if (text.find('=') != text.npos) {
    for (const std::string_view item : split(text, ',')) {
      const std::size_t equals = item.find('=');
      const auto label = equals == item.npos
                             ? std::nullopt
                             : whole_number<std::int64_t>(std::string(item.substr(0, equals)));
      if (!label) throw UsageError("--labels: '{}' is not LABEL=NAME, such as 1=bone", item);
      add_label(names, *label, item.substr(equals + 1));
    }
    return names;
  }
  const std::string content = text_of(text);
  for (const std::string_view line : split(content, '\n')) add_line(names, line, text);
  if (names.empty())
    throw UsageError("--labels: {}: has no line with the number and the name of a label", text);
  // Lists of programs have the background, too.
  if (names.size() > 1) names.erase(0);
  return names;
}

// A number and a unit, such as 0.5mm.
MeshLength length_in(std::string_view text, const std::string& all) {
  const std::size_t end = text.find_last_of("0123456789.");
  if (end == text.npos) throw UsageError("--size: '{}' is not a length, such as 0.5mm or 0.5mm..4mm", all);
  return {number_in("--size", text.substr(0, end + 1), all), std::string(text.substr(end + 1))};
}

void set_size(const std::string& text, MaterialMeshOptions& options) {
  if (text.empty()) return;
  const std::size_t dots = text.find("..");
  options.fine = length_in(std::string_view(text).substr(0, dots), text);
  if (dots == text.npos) return;
  options.coarse = length_in(std::string_view(text).substr(dots + 2), text);
  // 1..4mm
  if (options.fine->unit.empty()) options.fine->unit = options.coarse->unit;
}

}  // namespace

void add_material_options(CLI::App& command, MaterialTexts& texts) {
  add_text_option(command, "--materials", texts.materials, "NAME=LOW:HIGH,...",
                  "Materials by ranges of values");
  add_text_option(command, "--labels", texts.labels, "NAMES",
                  "The samples are labels of materials: LABEL=NAME,..., a file of names, or all");
  add_text_option(command, "--label-volume", texts.label_volume, "FILE",
                  "A .tag file with the labels of the volume");
  add_text_option(command, "--keep", texts.keep, "NAME,...",
                  "Mesh only these materials (default: all named ones)");
  add_text_option(command, "--parts", texts.parts, "largest|VOLUME",
                  "Of each material, only the largest connected part, or parts of at least VOLUME");
  add_number_option(command, "--smooth", texts.smooth, "W",
                    "Smooth interfaces of labels over W samples (default: 1; 0: not at all)");
  add_text_option(command, "--size", texts.size, "FINE[..COARSE]",
                  "Edges of the cubes at interfaces, and far from them, such as 0.5mm..4mm");
  add_number_option(command, "--angles", texts.angles, "9|15",
                    "Smallest dihedral angle: 9 degrees (default), or 15 with less exact vertices");
  add_number_option(command, "--order", texts.order, "1|2", "Tetrahedra with 4 nodes (default) or with 10");
  command.add_flag("--quality", texts.quality, "Print angles, volumes, surfaces and parts of the materials");
}

MaterialMeshOptions material_options(const MaterialTexts& texts) {
  MaterialMeshOptions options;
  if (!texts.materials.empty() && !(texts.labels.empty() && texts.label_volume.empty()))
    throw UsageError("--materials: cannot be combined with {}; samples are values or labels",
                     texts.labels.empty() ? "--label-volume" : "--labels");
  if (texts.materials.empty()) {
    options.labels.emplace();
    options.labels->names = label_names(texts.labels.empty() ? std::string(all_labels) : texts.labels);
    if (texts.smooth) options.labels->smoothing = *texts.smooth;
    options.label_volume = texts.label_volume;
  } else {
    if (texts.smooth) throw UsageError("--smooth: applies only to labels; give --labels");
    for (const std::string_view item : split(texts.materials, ',')) options.ranges.push_back(range_in(item));
  }
  if (!texts.keep.empty())
    for (const std::string_view name : split(texts.keep, ','))
      options.keep.push_back(set_name(name, std::string(name)));
  if (texts.parts == "largest") {
    options.parts.only_largest = true;
  } else if (!texts.parts.empty()) {
    const auto volume = finite_number(texts.parts);
    if (!volume) throw UsageError("--parts: '{}' is neither largest nor a volume", texts.parts);
    options.parts.least_volume = *volume;
    if (!(options.parts.least_volume > 0)) throw UsageError("--parts: the volume must be greater than 0");
  }
  set_size(texts.size, options);
  if (texts.order) options.order = *texts.order;
  if (texts.angles && *texts.angles != 9 && *texts.angles != 15)
    throw UsageError("--angles: must be 9 or 15");
  options.prefers_angles = texts.angles == 15;
  return options;
}

std::string first_given(const MaterialTexts& texts) {
  const std::pair<bool, const char*> given[] = {{!texts.keep.empty(), "--keep"},
                                                {!texts.parts.empty(), "--parts"},
                                                {texts.smooth.has_value(), "--smooth"},
                                                {!texts.size.empty(), "--size"},
                                                {texts.angles.has_value(), "--angles"},
                                                {texts.order.has_value(), "--order"},
                                                {texts.quality, "--quality"}};
  for (const auto& [is_given, name] : given)
    if (is_given) return name;
  return "";
}

}  // namespace tagrid
