#include "io/formats/vendors/descriptions.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>

#include "io/errors/errors.h"
#include "io/formats/vendors/sections.h"
#include "io/metadata/foreign_geometry.h"
#include "io/samples/data_files.h"
#include "io/text/foreign_number.h"
#include "io/text/text.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

std::int64_t integer_of(const std::string& file, std::string_view name, std::string_view text) {
  const auto number = whole_number_of(text);
  if (!number) throw BrokenInput(fmt::format("{}: {} {} must be a whole number", file, name, quoted(text)));
  return *number;
}

void require_size(const std::string& file, const Index3& dims, SampleType type) {
  if (!sample_bytes(dims, type) || !is_volume_size(dims))
    throw BrokenInput(fmt::format("{}: a volume cannot have {} samples", file, described(dims, type)));
}

KeyValues pairs_of(const Sections& sections, const std::string& prefix) {
  KeyValues pairs;
  for (const auto& [key, value] : sections)
    if (!value.empty()) pairs.emplace_back(prefix + key, value);
  return pairs;
}

/// The value of a field; nothing if the description does not have it.
std::optional<std::string_view> found(const Sections& sections, const std::string& key) {
  const auto field = sections.find(key);
  return field == sections.end() ? std::nullopt : std::optional<std::string_view>(field->second);
}

/// Three words of a text; empty ones if it has another number.
std::array<std::string_view, 3> three_words(std::string_view text) {
  const auto words = words_of(text);
  return words.size() == 3 ? std::array{words[0], words[1], words[2]} : std::array<std::string_view, 3>{};
}

SampleType type_of_vgi(const std::string& file, const Sections& sections) {
  const std::string kind = lower_case(required(sections, "file1/datatype", file));
  const std::int64_t bits =
      integer_of(file, "BitsPerElement", required(sections, "file1/bitsperelement", file));
  const char* name = kind == "float"                                 ? "float"
                     : kind == "unsigned integer"                    ? "uint"
                     : kind == "signed integer" || kind == "integer" ? "int"
                                                                     : "unknown";
  if (const auto type = sample_type_named(fmt::format("{}{}", name, bits))) return *type;
  throw BrokenInput(fmt::format("{}: samples of type {} with {} bits are not supported", file,
                                quoted(std::string_view(kind)), bits));
}

/// What the description of a volume says about its samples, and this reader does not apply.
std::vector<std::string> not_understood_in(const std::string& name, std::string_view text,
                                           const Sections& sections) {
  std::vector<std::string> sentences;
  const auto say = [&](const std::string& sentence) {
    sentences.push_back(fmt::format("{}: {}", name, sentence));
  };
  const auto text_of = [&](const std::string& key) { return found(sections, key).value_or(""); };
  if (const auto volumes = volumes_in(text); volumes.size() > 1)
    say(fmt::format("describes {} volumes ({}); only the first one is read", volumes.size(),
                    fmt::join(volumes, ", ")));
  const auto same_words = [](std::string_view a, std::string_view b) {
    return a.empty() || b.empty() || words_of(lower_case(a)) == words_of(lower_case(b));
  };
  if (!same_words(text_of("representation/size"), text_of("file1/size")))
    say(fmt::format("the volume has {} samples, and its file {}; those of the file are read",
                    quoted(text_of("representation/size")), quoted(text_of("file1/size"))));
  if (!same_words(text_of("representation/datatype"), text_of("file1/datatype")) ||
      !same_words(text_of("representation/bitsperelement"), text_of("file1/bitsperelement")))
    say(fmt::format(
        "samples of type {} (data range {}) are to be mapped to type {} (data range {}); they are read as "
        "they are stored",
        quoted(text_of("file1/datatype")), quoted(text_of("file1/datarange")),
        quoted(text_of("representation/datatype")), quoted(text_of("representation/datarange"))));
  for (const std::string field : {"representation/mirror", "file1/mirror"})
    if (const auto words = words_of(text_of(field));
        std::ranges::any_of(words, [](auto word) { return word != "0"; }))
      say(fmt::format("{} is {}; samples are read in the order of the file", field, quoted(text_of(field))));
  const std::array<std::string_view, 3> size = three_words(text_of("file1/size")),
                                        low = three_words(text_of("file1/regionofintereststart")),
                                        high = three_words(text_of("file1/regionofinterestend"));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto first = whole_number_of(low[axis]), last = whole_number_of(high[axis]),
               whole = whole_number_of(size[axis]);
    const bool is_part = (first && *first != 0) || (last && whole && *last != *whole - 1);
    if (!is_part) continue;
    say(fmt::format("only samples from {} to {} are to be used; all are read",
                    quoted(text_of("file1/regionofintereststart")),
                    quoted(text_of("file1/regionofinterestend"))));
    break;
  }
  return sentences;
}

/// Samples that are spread over several files, or lie in another byte order, are not those of the first file.
void refuse_what_changes_samples(const std::string& name, const Sections& sections) {
  if (sections.lower_bound("file2/") != sections.lower_bound("file20"))
    throw BrokenInput(name + ": section [file2]: samples in several files are not supported");
  for (const auto& [key, value] : sections) {
    if (!key.starts_with("file1/")) continue;
    const bool is_order = key.find("endian") != key.npos || key.find("byteorder") != key.npos;
    if ((is_order && lower_case(value).find("little") == value.npos) ||
        (key.find("compress") != key.npos && value != "0" && lower_case(value) != "none"))
      throw BrokenInput(
          fmt::format("{}: {} {} is not supported", name, key, quoted(std::string_view(value))));
  }
}

}  // namespace

TextDescription describe_vgi(FileBytes& file, const std::string& path) {
  const std::string name = file.name();
  const std::string text = read_description(file);
  const Sections sections = parse_sections(text);
  refuse_what_changes_samples(name, sections);
  const std::string size = required(sections, "file1/size", name);
  const auto words = words_of(size);
  if (words.size() != 3)
    throw BrokenInput(fmt::format("{}: Size {} must be 3 numbers", name, quoted(std::string_view(size))));
  const Index3 dims{integer_of(name, "Size", words[0]), integer_of(name, "Size", words[1]),
                    integer_of(name, "Size", words[2])};
  const SampleType type = type_of_vgi(name, sections);
  require_size(name, dims, type);
  if (const auto format = sections.find("file1/fileformat");
      format != sections.end() && lower_case(format->second) != "raw")
    throw BrokenInput(fmt::format("{}: samples in the format {} are not supported", name,
                                  quoted(std::string_view(format->second))));
  std::uint64_t offset = 0;
  if (const auto skip = sections.find("file1/skipheader"); skip != sections.end() && !skip->second.empty()) {
    const std::int64_t bytes = integer_of(name, "SkipHeader", skip->second);
    if (bytes < 0) throw BrokenInput(fmt::format("{}: SkipHeader is {}", name, bytes));
    offset = static_cast<std::uint64_t>(bytes);
  }
  TextDescription result{.path = path, .dims = dims, .type = type, .offset = offset};
  Geometry& geometry = result.geometry;
  const ForeignNumbers resolution = foreign_numbers(found(sections, "geometry/resolution"), 3);
  const std::string of_resolution =
      fmt::format("{}: of resolution {}, one", name, quoted(std::string_view(resolution.text)));
  if (resolution.numbers.empty() && !resolution.is_absent)
    result.warnings.push_back(
        fmt::format("{}: {}", name, remark_on(resolution, "resolution", "spacing is unknown")));
  set_spacing(resolution.numbers, {of_resolution}, NegativeSpacing::is_unknown, geometry, result.warnings);
  if (geometry.has_spacing) geometry.units.fill(std::string(found(sections, "geometry/unit").value_or("mm")));
  if (const auto scale = found(sections, "geometry/scale");
      scale && std::ranges::any_of(words_of(*scale), [](auto word) { return number_of(word) != 1; }))
    result.warnings.push_back(fmt::format(
        "{}: scale is {}, which is not applied; the resolution alone is the spacing", name, quoted(*scale)));
  std::string data_file = required(sections, "file1/name", name);
  // Programs for Windows write whole paths.
  if (const std::size_t slash = data_file.rfind('\\'); slash != data_file.npos) data_file.erase(0, slash + 1);
  result.data_file = data_file;
  result.data_path = path_of_data_file(path, data_file);
  result.not_understood = not_understood_in(name, text, sections);
  result.pairs = pairs_of(sections, "vgi_");
  return result;
}

TextDescription describe_xtekct(FileBytes& file, const std::string& path) {
  const std::string name = file.name();
  if (path == "-")
    throw UsageError(name + ": is a Nikon file, whose samples are in another file; give it by its name");
  const Sections sections = read_sections(file);
  const auto count = [&](const char* field) {
    return integer_of(name, field, required(sections, "xtekct/" + lower_case(field), name));
  };
  const Index3 dims{count("VoxelsX"), count("VoxelsY"), count("VoxelsZ")};
  require_size(name, dims, SampleType::uint8);
  const fs::path data_path = fs::path(path).replace_extension(".vol");
  TextDescription result{.path = path,
                         .data_path = data_path.string(),
                         .data_file = data_path.filename().string(),
                         .dims = dims};
  Geometry& geometry = result.geometry;
  std::vector<ForeignNumber> sizes;
  std::vector<std::string> names;
  for (const char axis : {'X', 'Y', 'Z'}) {
    names.push_back(fmt::format("{}: VoxelSize{}", name, axis));
    sizes.push_back(foreign_number(found(sections, lower_case(fmt::format("xtekct/voxelsize{}", axis)))));
  }
  set_spacing(sizes, names, NegativeSpacing::is_unknown, geometry, result.warnings);
  if (geometry.has_spacing) geometry.units.fill("mm");
  result.pairs = pairs_of(sections, "xtekct_");
  return result;
}

}  // namespace tagrid
