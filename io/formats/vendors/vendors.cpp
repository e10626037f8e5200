#include "io/formats/vendors/vendors.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <optional>
#include <string>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/files/slice_files.h"
#include "io/formats/vendors/sections.h"
#include "io/metadata/foreign_geometry.h"
#include "io/metadata/lengths.h"
#include "io/metadata/metadata.h"
#include "io/metadata/rescale.h"
#include "io/samples/data_files.h"
#include "io/samples/file_samples.h"
#include "io/samples/slices_in_files.h"
#include "io/system/files.h"
#include "io/text/foreign_number.h"
#include "io/text/paths.h"
#include "io/text/text.h"
#include "io/volume/given_spacing.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

// VGStudio and Nikon: a text file describes samples that are in another file.

/// What a text says of a volume.
struct TextDescription {
  std::string path = {};       ///< of the text
  std::string data_path = {};  ///< of the samples
  std::string data_file = {};  ///< the name of their file, as the text has it
  Index3 dims = {};
  std::optional<SampleType> type = {};  ///< nothing: it follows from the size of the file
  std::uint64_t offset = 0;             ///< the byte of the file at which samples begin
  bool big_endian = false;
  Geometry geometry = {};
  KeyValues pairs = {};
  std::vector<std::string> warnings = {}, not_understood = {};  ///< as in SourceFacts
};

std::int64_t integer_of(const std::string& file, std::string_view name, std::string_view text) {
  const auto number = whole_number_of(text);
  if (!number) throw BrokenInput("{}: {} {} must be a whole number", file, name, quoted(text));
  return *number;
}

void require_size(const std::string& file, const Index3& dims, SampleType type) {
  if (!sample_bytes(dims, type) || !is_volume_size(dims))
    throw BrokenInput("{}: a volume cannot have {} samples", file, described(dims, type));
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
  throw BrokenInput("{}: samples of type {} with {} bits are not supported", file,
                    quoted(std::string_view(kind)), bits);
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
      throw BrokenInput("{}: {} {} is not supported", name, key, quoted(std::string_view(value)));
  }
}

/// Reads .vgi and .xtekct. `file` was opened at `path` and is at its beginning. They throw BrokenInput and
/// WorldError, and UsageError for the standard input if the text does not name the file of the samples.
TextDescription describe_vgi(FileBytes& file, const std::string& path) {
  const std::string name = file.name();
  const std::string text = read_description(file);
  const Sections sections = parse_sections(text);
  refuse_what_changes_samples(name, sections);
  const std::string size = required(sections, "file1/size", name);
  const auto words = words_of(size);
  if (words.size() != 3)
    throw BrokenInput("{}: Size {} must be 3 numbers", name, quoted(std::string_view(size)));
  const Index3 dims{integer_of(name, "Size", words[0]), integer_of(name, "Size", words[1]),
                    integer_of(name, "Size", words[2])};
  const SampleType type = type_of_vgi(name, sections);
  require_size(name, dims, type);
  if (const auto format = sections.find("file1/fileformat");
      format != sections.end() && lower_case(format->second) != "raw")
    throw BrokenInput("{}: samples in the format {} are not supported", name,
                      quoted(std::string_view(format->second)));
  std::uint64_t offset = 0;
  if (const auto skip = sections.find("file1/skipheader"); skip != sections.end() && !skip->second.empty()) {
    const std::int64_t bytes = integer_of(name, "SkipHeader", skip->second);
    if (bytes < 0) throw BrokenInput("{}: SkipHeader is {}", name, bytes);
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
  const fs::path data_path = path_of(path).replace_extension(".vol");
  TextDescription result{.path = path,
                         .data_path = text_of(data_path),
                         .data_file = text_of(data_path.filename()),
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

// Volumes of VGStudio and Nikon. Nikon's program writes both descriptions of one .vol file: the volume has both.

/// One of the two kinds of descriptions.
struct Kind {
  std::string_view name, extension;
  bool (*begins)(std::string_view bytes);
  TextDescription (*describe)(FileBytes& file, const std::string& path);
};

constexpr Kind vgi = {"VGStudio", ".vgi", begins_vgi, describe_vgi};
constexpr Kind xtekct = {"Nikon", ".xtekct", begins_xtekct, describe_xtekct};

/// The other description of the samples; `described` is empty if it cannot be read, and `why_not` says why.
struct OtherDescription {
  std::string path;
  std::optional<TextDescription> described;
  std::string why_not;
};

std::optional<OtherDescription> read_other(const Kind& kind, const std::string& path,
                                           const std::string& data_path) {
  const auto status = status_of(path);
  if (!status || !status->is_file()) return std::nullopt;
  try {
    FileBytes file(path);
    if (!kind.begins(file.peek(64))) return std::nullopt;
    OtherDescription other{path, kind.describe(file, path), ""};
    if (!is_same_file(other.described->data_path, data_path)) return std::nullopt;
    return other;
  } catch (const Error& error) {
    return OtherDescription{path, std::nullopt, error.what()};
  }
}

/// The description of the same samples in the other format, in their directory. One that cannot be
/// read is assumed to describe them if it has their name.
std::optional<OtherDescription> other_description(const Kind& kind, const std::string& data_path) {
  const fs::path data = path_of(data_path), folder = data.parent_path();
  if (const auto status = status_of(folder.empty() ? "." : text_of(folder)); !status || !status->is_folder())
    return std::nullopt;
  std::vector<std::string> candidates;
  for (const std::string& path : visible_files(folder.empty() ? "." : text_of(folder)))
    if (extension_of(path) == kind.extension)
      candidates.push_back(text_of(folder / path_of(path).filename()));
  std::stable_partition(candidates.begin(), candidates.end(),
                        [&](const std::string& path) { return path_of(path).stem() == data.stem(); });
  for (const std::string& path : candidates)
    if (auto other = read_other(kind, path, data_path);
        other && (other->described || path_of(path).stem() == data.stem()))
      return other;
  return std::nullopt;
}

/// The distance between samples along an axis in mm; nothing if it is not known.
std::optional<double> distance_of(const Geometry& geometry, std::size_t axis) {
  const auto unit = length_unit(geometry.units[axis]);
  if (!geometry.has_spacing || !unit || !std::isfinite(geometry.spacing[axis])) return std::nullopt;
  return converted(geometry.spacing[axis], *unit, *length_unit("mm"));
}

/// Says where two descriptions of one file contradict each other.
void compare(const TextDescription& own, const TextDescription& other, SourceFacts& facts) {
  const auto say = [&](const std::string& one, const std::string& two) {
    facts.not_understood.push_back(
        fmt::format("{} states {}, but {} states {}; the former is used", own.path, one, other.path, two));
  };
  const auto size = [](const Index3& dims) {
    return fmt::format("{} x {} x {} samples", dims.x, dims.y, dims.z);
  };
  if (own.dims != other.dims) say(size(own.dims), size(other.dims));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto one = distance_of(own.geometry, axis), two = distance_of(other.geometry, axis);
    // Both are rounded texts.
    if (!one || !two || std::abs(*one - *two) <= 1e-4 * *one) continue;
    const auto distance = [&](double mm) {
      return fmt::format("a distance of {:.6g} mm along {}", mm, "xyz"[axis]);
    };
    say(distance(*one), distance(*two));
    return;
  }
}

/// The type of samples by the size of their file: Nikon's description does not say it.
SampleType type_by_size(const TextDescription& own, const FileBytes& data) {
  for (const SampleType one : {SampleType::uint8, SampleType::uint16, SampleType::float32})
    if (sample_bytes(own.dims, one) == data.size()) return one;
  throw BrokenInput("{}: has {} bytes, but {} x {} x {} samples of 1, 2 or 4 bytes are expected ({})",
                    data.name(), data.size().value_or(0), own.dims.x, own.dims.y, own.dims.z, own.path);
}

std::unique_ptr<VolumeSource> open_described(const Kind& kind, const Kind& other_kind,
                                             std::unique_ptr<FileBytes> file, const std::string& path,
                                             const SourceDescription& source) {
  TextDescription own = kind.describe(*file, path);
  SourceFacts facts;
  facts.files = {path};
  facts.warnings = std::move(own.warnings);
  const auto other = other_description(other_kind, own.data_path);
  if (other) facts.files.push_back(other->path);
  facts.files.push_back(own.data_path);
  require_inside(path, {facts.files.begin() + 1, facts.files.end()}, source.data_outside, facts.warnings);
  const auto data = open_data_file(own.data_path, own.data_file, file->name(), kind.name);
  facts.not_understood = std::move(own.not_understood);
  std::optional<SampleType> type = own.type;
  if (other && other->described) {
    compare(own, *other->described, facts);
    own.pairs.insert(own.pairs.end(), other->described->pairs.begin(), other->described->pairs.end());
    if (const auto given = other->described->type;
        !type && given && sample_bytes(own.dims, *given) == data->size())
      type = given;
  } else if (other) {
    facts.warnings.push_back(
        fmt::format("{}: the other description of its samples cannot be read: {}", path, other->why_not));
  }
  if (!type) type = type_by_size(own, *data);
  facts.info = {own.dims, *type, Metadata(own.geometry, own.pairs)};
  facts.holds_other_bytes = true;  // the description says more than the file that is made
  SamplesPlace place{.start = own.offset};
  allow_more(*data, place, facts);
  const std::uint64_t slice = *sample_bytes({own.dims.x, own.dims.y, 1}, *type);
  const std::size_t number = facts.files.size() - 1;
  return placed_samples(std::move(facts), {{number, own.offset, own.dims.z, slice, false}});
}

}  // namespace

bool begins_vgi(std::string_view bytes) {
  const std::size_t begin = bytes.find_first_not_of(" \t\r\n");
  return begin != bytes.npos && bytes.substr(begin).starts_with("{volume");
}

bool begins_xtekct(std::string_view bytes) {
  if (bytes.starts_with("\xEF\xBB\xBF")) bytes.remove_prefix(3);
  return bytes.starts_with("[XTekCT]");
}

std::unique_ptr<VolumeSource> open_vgi(std::unique_ptr<FileBytes> file, const std::string& path,
                                       const SourceDescription& source) {
  return open_described(vgi, xtekct, std::move(file), path, source);
}

std::unique_ptr<VolumeSource> open_xtekct(std::unique_ptr<FileBytes> file, const std::string& path,
                                          const SourceDescription& source) {
  return open_described(xtekct, vgi, std::move(file), path, source);
}

// PyHST: lines of names and values, next to samples.

namespace {

/// The value of one of the lines; nothing if there is none.
std::optional<std::string_view> line_of(std::string_view text, std::string_view name) {
  while (!text.empty()) {
    const std::string_view line = take_line(text);
    const std::size_t equals = line.find('=');
    if (equals != line.npos && trimmed(line.substr(0, equals)) == name)
      return trimmed(line.substr(equals + 1));
  }
  return std::nullopt;
}

TextDescription describe_pyhst(FileBytes& file, const std::string& path) {
  const std::string name = file.name();
  constexpr std::string_view ending = ".info";
  if (path == "-" || !lower_case(path).ends_with(ending) || path_of(path).stem().empty())
    throw UsageError(
        name +
        ": describes samples in another file, which has the same name without .info; give it by its name");
  const std::string text = read_description(file);
  const auto count = [&](const char* field) {
    const auto value = line_of(text, field);
    if (!value) throw BrokenInput("{}: {} is missing", name, field);
    return integer_of(name, field, *value);
  };
  const Index3 dims{count("NUM_X"), count("NUM_Y"), count("NUM_Z")};
  require_size(name, dims, SampleType::uint8);
  const std::string data_path = path.substr(0, path.size() - ending.size());
  TextDescription result{
      .path = path, .data_path = data_path, .data_file = name_of_path(data_path), .dims = dims};
  if (const auto type = line_of(text, "DATA_TYPE")) {
    result.type = sample_type_named(lower_case(*type) == "float" ? "float32" : lower_case(*type));
    if (!result.type) throw BrokenInput("{}: samples of type {} are not supported", name, quoted(*type));
    require_size(name, dims, *result.type);
  }
  const std::string order = lower_case(line_of(text, "BYTEORDER").value_or(""));
  result.big_endian = order == "highbytefirst";
  if (!result.big_endian && !order.empty() && order != "lowbytefirst")
    throw BrokenInput("{}: BYTEORDER {} must be LOWBYTEFIRST or HIGHBYTEFIRST", name,
                      quoted(std::string_view(order)));
  const ForeignNumber size = foreign_number(line_of(text, "voxelSize"));
  set_spacing({size, size, size}, {name + ": voxelSize"}, NegativeSpacing::is_unknown, result.geometry,
              result.warnings);
  if (result.warnings.size() > 1) result.warnings.resize(1);  // it is the same number three times
  if (result.geometry.has_spacing) result.geometry.units.fill("um");
  for (std::string_view rest = text; !rest.empty();) {
    const std::string_view line = take_line(rest);
    const std::size_t equals = std::min(line.find('='), line.size());
    const std::string_view key = trimmed(line.substr(0, equals)), value = trimmed(line.substr(equals));
    if (!key.empty() && value.size() > 1)
      result.pairs.emplace_back(fmt::format("pyhst_{}", key), trimmed(value.substr(1)));
  }
  return result;
}

}  // namespace

bool begins_pyhst(std::string_view bytes) {
  if (bytes.starts_with("! PyHST")) return true;
  constexpr std::string_view first = "NUM_X";
  if (!bytes.starts_with(first)) return false;
  return trimmed(bytes.substr(first.size(), bytes.find('\n') - first.size())).starts_with('=');
}

std::unique_ptr<VolumeSource> open_pyhst(std::unique_ptr<FileBytes> file, const std::string& path,
                                         const SourceDescription& source) {
  TextDescription own = describe_pyhst(*file, path);
  SourceFacts facts;
  facts.files = {path, own.data_path};
  facts.warnings = std::move(own.warnings);
  require_inside(path, {own.data_path}, source.data_outside, facts.warnings);
  const auto data = open_data_file(own.data_path, own.data_file, file->name(), "PyHST");
  const SampleType type = own.type ? *own.type : type_by_size(own, *data);
  facts.info = {own.dims, type, Metadata(own.geometry, own.pairs)};
  facts.holds_other_bytes = true;
  facts.missing_of_voxel_size = missing_of_voxel_size(own.geometry, true);
  SamplesPlace place;
  allow_more(*data, place, facts);
  return placed_samples(std::move(facts), {{.file = 1,
                                            .slices = own.dims.z,
                                            .step = *sample_bytes({own.dims.x, own.dims.y, 1}, type),
                                            .big_endian = own.big_endian}});
}

// Scanco's .isq. The layout follows InsightSoftwareConsortium/ITKIOScanco (Apache-2.0), which describes it.

namespace {

constexpr std::size_t block = 512;

}  // namespace

bool begins_isq(std::string_view bytes) { return bytes.starts_with("CTDATA-HEADER_V1"); }

std::unique_ptr<VolumeSource> open_isq(std::unique_ptr<FileBytes> file, const std::string& path,
                                       const SourceDescription&) {
  const std::string name = file->name();
  if (path == "-" || !file->size())
    throw UsageError(name + ": is a Scanco file, which can only be read from a file; save it to one first");
  const std::string header(file->peek(block));
  if (header.size() < block) throw BrokenInput(name + ": ends within its header");
  const auto number = [&](std::size_t at) {
    return load_little_endian<std::int32_t>(reinterpret_cast<const std::byte*>(header.data()) + at);
  };
  const Index3 dims{number(44), number(48), number(52)};
  if (number(16) != 3)
    throw BrokenInput("{}: samples of type {} are not supported, only those of type 3 (16 bits)", name,
                      number(16));
  if (!sample_bytes(dims, SampleType::int16) || !is_volume_size(dims))
    throw BrokenInput("{}: a volume cannot have {} samples", name, described(dims, SampleType::int16));
  if (number(508) < 0) throw BrokenInput("{}: its samples begin in block {}", name, number(508));
  const std::uint64_t offset = (static_cast<std::uint64_t>(number(508)) + 1) * block;

  SourceFacts facts;
  facts.files = {path};
  Geometry geometry;
  const std::array<std::int64_t, 3> sizes = {dims.x, dims.y, dims.z};
  std::vector<ForeignNumber> distances;
  std::vector<std::string> names;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // The size of the whole axis is in micrometers.
    distances.push_back(foreign_number(number(56 + 4 * axis) / 1000.0 / static_cast<double>(sizes[axis])));
    names.push_back(fmt::format("{}: the size of axis {} in its header", name, axis + 1));
  }
  set_spacing(distances, names, NegativeSpacing::is_unknown, geometry, facts.warnings);
  if (geometry.has_spacing) geometry.units.fill("mm");
  Rescale rescale;
  if (number(88) > 1)
    rescale = {1.0 / number(88), 0, "1/cm"};
  else if (number(88) < 0)
    facts.scale_doubt = fmt::format(
        "{}: mu_scaling in its header is {}, and must be positive; what values samples mean "
        "is unknown",
        name, number(88));
  KeyValues pairs;
  add_rescale(rescale, pairs);
  std::string patient = header.substr(128, 40);
  patient.erase(std::min(patient.find('\0'), patient.size()));
  patient.erase(patient.find_last_not_of(' ') + 1);
  if (!patient.empty()) pairs.emplace_back("isq_name", patient);
  constexpr std::array<std::pair<const char*, std::size_t>, 14> fields = {{{"patient_index", 28},
                                                                           {"scanner_id", 32},
                                                                           {"slice_thickness_um", 68},
                                                                           {"slice_increment_um", 72},
                                                                           {"slice_1_pos_um", 76},
                                                                           {"min_data_value", 80},
                                                                           {"max_data_value", 84},
                                                                           {"mu_scaling", 88},
                                                                           {"nr_of_samples", 92},
                                                                           {"nr_of_projections", 96},
                                                                           {"scanner_type", 104},
                                                                           {"sampletime_us", 108},
                                                                           {"energy", 168},
                                                                           {"intensity", 172}}};
  for (const auto& [field, at] : fields)
    pairs.emplace_back(fmt::format("isq_{}", field), std::to_string(number(at)));
  facts.info = {dims, SampleType::int16, Metadata(geometry, pairs)};
  facts.rescale = rescale;
  facts.holds_other_bytes = true;
  // Files are filled up to whole blocks.
  const std::uint64_t end = offset + *sample_bytes(dims, SampleType::int16);
  SamplesPlace place{.start = offset};
  if (*file->size() > end && *file->size() - end >= block) allow_more(*file, place, facts);
  return placed_samples(std::move(facts),
                        {{0, offset, dims.z, *sample_bytes({dims.x, dims.y, 1}, SampleType::int16), false}});
}

}  // namespace tagrid
