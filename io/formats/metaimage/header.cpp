#include "io/formats/metaimage/header.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "io/errors/errors.h"
#include "io/files/slice_files.h"
#include "io/formats/nrrd/text_header.h"
#include "io/metadata/foreign_geometry.h"
#include "io/metadata/lengths.h"
#include "io/metadata/loss.h"
#include "io/metadata/rescale.h"
#include "io/samples/file_samples.h"
#include "io/text/foreign_number.h"
#include "io/text/text.h"
#include "io/volume/one_of_volumes.h"
#include "io/volume/sample_places.h"
#include "io/volume/volume_source.h"

namespace tagrid {
namespace {

/// Names in lower case, and values.
using Fields = std::map<std::string, std::string_view>;

/// Fields that are read here, or that say how samples are stored.
constexpr std::array read_fields = {"objecttype",
                                    "ndims",
                                    "dimsize",
                                    "elementtype",
                                    "elementdatafile",
                                    "binarydata",
                                    "elementbyteordermsb",
                                    "binarydatabyteordermsb",
                                    "compresseddata",
                                    "compresseddatasize",
                                    "headersize",
                                    "elementnumberofchannels",
                                    "elementspacing",
                                    "transformmatrix",
                                    "offset",
                                    "origin",
                                    "position"};

[[noreturn]] void refuse(std::string_view field, std::string_view value, std::string_view why) {
  throw BrokenInput("MetaImage header: {} {}: {}", field, quoted(value), why);
}

struct Line {
  std::string_view name, value;
};

std::optional<Line> parse_line(std::string_view line) {
  const std::size_t sign = line.find_first_of("=:");
  if (sign == line.npos) return std::nullopt;
  return Line{trimmed(line.substr(0, sign)), trimmed(line.substr(sign + 1))};
}

std::string_view value_of(const Fields& fields, const char* name) {
  const auto found = fields.find(name);
  return found == fields.end() ? "" : found->second;
}

/// The value of the first of these fields that is there.
std::string_view value_of_one(const Fields& fields, std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (const std::string_view value = value_of(fields, name); !value.empty()) return value;
  return "";
}

std::int64_t integer_of(std::string_view field, std::string_view text) {
  const auto number = whole_number_of(text);
  if (!number) refuse(field, text, "must be a whole number");
  return *number;
}

bool is_true(std::string_view field, std::string_view value) {
  const std::string word = lower_case(value);
  if (word.empty() || word == "false" || word == "0" || word == "f" || word == "no") return false;
  if (word == "true" || word == "1" || word == "t" || word == "yes") return true;
  refuse(field, value, "must be True or False");
}

/// The first name of a type is written. MET_LONG has 4 bytes wherever MetaIO runs, and MET_LONG_LONG has 8.
constexpr std::array element_types = {std::pair{std::string_view("MET_UCHAR"), SampleType::uint8},
                                      std::pair{std::string_view("MET_CHAR"), SampleType::int8},
                                      std::pair{std::string_view("MET_USHORT"), SampleType::uint16},
                                      std::pair{std::string_view("MET_SHORT"), SampleType::int16},
                                      std::pair{std::string_view("MET_UINT"), SampleType::uint32},
                                      std::pair{std::string_view("MET_INT"), SampleType::int32},
                                      std::pair{std::string_view("MET_FLOAT"), SampleType::float32},
                                      std::pair{std::string_view("MET_DOUBLE"), SampleType::float64},
                                      std::pair{std::string_view("MET_ULONG"), SampleType::uint32},
                                      std::pair{std::string_view("MET_LONG"), SampleType::int32}};

SampleType type_of(std::string_view value) {
  for (const auto& [name, type] : element_types)
    if (name == value) return type;
  refuse("ElementType", value, "not supported");
}

/// The samples of one volume along x, y, z, and the number of volumes.
std::pair<Index3, std::int64_t> dims_of(const Fields& fields) {
  const std::int64_t axes = integer_of("NDims", value_of(fields, "ndims"));
  const std::string_view value = value_of(fields, "dimsize");
  if (axes < 2 || axes > 4) refuse("NDims", value_of(fields, "ndims"), "must be 2, 3 or 4");
  const auto words = words_of(value);
  if (words.size() != static_cast<std::size_t>(axes))
    refuse("DimSize", value, fmt::format("must be {} numbers", axes));
  std::array<std::int64_t, 4> sizes = {1, 1, 1, 1};
  for (std::size_t i = 0; i < words.size(); ++i) {
    sizes[i] = integer_of("DimSize", words[i]);
    if (sizes[i] < 1) refuse("DimSize", value, "must be positive");
  }
  return {{sizes[0], sizes[1], sizes[2]}, sizes[3]};
}

/// The numbers of the first of these fields that is there. Adds what is unusual about them to `warnings`.
ForeignNumbers numbers_of(const Fields& fields, std::initializer_list<const char*> names,
                          std::string_view name, std::size_t count, std::string_view consequence,
                          std::vector<std::string>& warnings) {
  for (const char* one : names)
    if (const auto found = fields.find(one); found != fields.end()) {
      ForeignNumbers numbers = foreign_numbers(found->second, count);
      if (const std::string remark = remark_on(numbers, name, consequence); !remark.empty())
        warnings.push_back("MetaImage header: " + remark);
      return numbers;
    }
  return {};
}

/// Each row of the matrix is the direction of one axis, as ITK reads it.
std::optional<std::array<std::array<double, 3>, 3>> directions_of(const Fields& fields, std::size_t axes,
                                                                  std::vector<std::string>& warnings) {
  const ForeignNumbers matrix =
      numbers_of(fields, {"transformmatrix", "rotation", "orientation"}, "TransformMatrix", axes * axes,
                 "directions are unknown", warnings);
  if (!matrix.are_numbers()) return std::nullopt;
  std::array<std::array<double, 3>, 3> directions = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  for (std::size_t axis = 0; axis < std::min<std::size_t>(axes, 3); ++axis)
    for (std::size_t row = 0; row < std::min<std::size_t>(axes, 3); ++row)
      directions[axis][row] = matrix.numbers[axis * axes + row].value;
  if (const double volume = determinant(directions); volume != 0 && std::isfinite(volume)) return directions;
  warnings.push_back(
      fmt::format("MetaImage header: TransformMatrix {} does not span a volume; directions are unknown",
                  quoted(std::string_view(matrix.text))));
  return std::nullopt;
}

void read_spacing(const Fields& fields, std::size_t axes, Geometry& geometry,
                  std::vector<std::string>& warnings) {
  std::vector<std::string> none;
  const ForeignNumbers spacing =
      numbers_of(fields, {"elementspacing", "elementsize"}, "ElementSpacing", axes, "", none);
  if (spacing.is_absent) return;
  if (spacing.numbers.empty())
    warnings.push_back("MetaImage header: " + remark_on(spacing, "ElementSpacing", "spacing is unknown"));
  else
    set_spacing(
        spacing.numbers,
        {fmt::format("MetaImage header: of ElementSpacing {}, one", quoted(std::string_view(spacing.text)))},
        NegativeSpacing::mirrors, geometry, warnings);
}

/// ITK then takes the axes for those of its world, and the first sample for the origin.
bool has_no_place(const Fields& fields) {
  return std::ranges::none_of(
      std::array{"transformmatrix", "rotation", "orientation", "offset", "origin", "position"},
      [&](const char* name) { return fields.contains(name); });
}

Geometry geometry_of_header(const Fields& fields, std::size_t axes, std::vector<std::string>& warnings) {
  Geometry geometry;
  read_spacing(fields, axes, geometry, warnings);
  const ForeignNumbers offset = numbers_of(fields, {"offset", "origin", "position"}, "Offset", axes,
                                           "where the volume lies is unknown", warnings);
  if (offset.are_numbers()) {
    for (std::size_t axis = 0; axis < std::min<std::size_t>(axes, 3); ++axis)
      geometry.origin[axis] = offset.numbers[axis].value;
    geometry.has_origin = true;
  }
  const auto directions = directions_of(fields, axes, warnings);
  const bool is_plain = has_no_place(fields) && geometry.has_spacing && !has_unknown_spacing(geometry);
  if (directions || geometry.has_origin || is_plain) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (directions)
        geometry.directions[axis] = (*directions)[axis];
      else
        geometry.directions[axis][axis] = 1;
      for (double& number : geometry.directions[axis]) number *= spacing_or_1(geometry, axis);
    }
    geometry.has_directions = true;
    // Without an offset, ITK has 0.
    geometry.has_origin = offset.is_absent || offset.are_numbers();
    geometry.space = "left-posterior-superior";
  }
  geometry.units.fill(std::string(value_of(fields, "distanceunits")));
  return geometry;
}

Rescale rescale_of(const Fields& fields, MetaImageHeader& header) {
  const auto number = [&](const char* key, std::string_view name, double otherwise) {
    const auto found = fields.find(key);
    const ForeignNumber value =
        foreign_number(found == fields.end() ? std::nullopt : std::optional(found->second));
    const std::string remark = remark_on(value, name, "what values samples mean is unknown");
    if (value.is_unreadable())
      header.scale_doubt = "MetaImage header: " + remark;
    else if (!remark.empty())
      header.warnings.push_back("MetaImage header: " + remark);
    return value.value_or(otherwise);
  };
  Rescale rescale;
  rescale.slope = number("elementtointensityfunctionslope", "ElementToIntensityFunctionSlope", 1);
  rescale.intercept = number("elementtointensityfunctionoffset", "ElementToIntensityFunctionOffset", 0);
  if (rescale.slope != 0) return rescale;
  header.warnings.emplace_back(
      "MetaImage header: ElementToIntensityFunctionSlope is 0, which counts as no slope");
  return {};
}

std::optional<FilePattern> pattern_of(std::string_view name) {
  try {
    return file_pattern(name);
  } catch (const BrokenInput& error) {
    refuse("ElementDataFile", name, error.what());
  }
}

/// `list`: what follows "ElementDataFile = LIST". `volumes` of so many `slices` each.
std::vector<std::string> data_files_of(std::string_view value, std::string_view list, std::int64_t volumes,
                                       std::int64_t slices) {
  const auto words = words_of(value);
  if (words.empty()) refuse("ElementDataFile", value, "must name a file");
  std::vector<std::string> files;
  if (value == "LOCAL" || value == "Local" || value == "local") return files;
  if (words.size() >= 3 && pattern_of(words[0])) {
    const std::int64_t step = words.size() > 3 ? integer_of("ElementDataFile", words[3]) : 1;
    try {
      files =
          pattern_of(words[0])->names(integer_of("ElementDataFile", words[1]),
                                      integer_of("ElementDataFile", words[2]), step, max_meta_image_files);
    } catch (const BrokenInput& error) {
      refuse("ElementDataFile", value, error.what());
    }
  } else if (words[0] == "LIST") {
    while (!list.empty())
      if (const std::string_view name = trimmed(take_line(list)); !name.empty()) files.emplace_back(name);
  } else {
    return {std::string(value)};
  }
  const auto count = static_cast<std::int64_t>(files.size());
  if (count > 1 && volumes > 1)
    refuse("ElementDataFile", value,
           fmt::format("{} volumes in several files are not supported; write a header for each volume",
                       volumes));
  if (count == 0 || count > max_meta_image_files || slices % count != 0)
    refuse("ElementDataFile", value,
           fmt::format("{} files cannot have equal parts of {} slices", count, slices));
  return files;
}

/// Takes the lines up to ElementDataFile from `text`. Other fields than those that are read here go to
/// `pairs`.
Fields take_fields(std::string_view& text, KeyValues& pairs) {
  Fields fields;
  while (!text.empty()) {
    const std::string_view whole = take_line(text);
    if (trimmed(whole).empty()) continue;
    const auto line = parse_line(whole);
    if (!line)
      throw BrokenInput("MetaImage header: the line " + quoted(whole) + " is not a name and a value");
    const std::string name = lower_case(line->name);
    if (!fields.emplace(name, line->value).second) refuse(line->name, line->value, "is given twice");
    if (name == "elementdatafile") return fields;
    if (line->name == meta_image_loss)
      pairs.emplace_back(lossy_source_key, line->value);
    else if (std::ranges::find(read_fields, name) == read_fields.end())
      pairs.emplace_back(fmt::format("metaimage_{}", line->name), line->value);
  }
  throw BrokenInput("MetaImage header: ElementDataFile is missing");
}

}  // namespace

std::string_view meta_image_name_of(SampleType type) {
  return std::ranges::find(element_types, type, &std::pair<std::string_view, SampleType>::second)->first;
}

bool begins_meta_image(std::string_view bytes) {
  for (const std::string_view name : {"ObjectType", "NDims"})
    if (bytes.starts_with(name)) {
      const std::size_t next = bytes.find_first_not_of(" \t", name.size());
      return next == bytes.npos || bytes[next] == '=' || bytes[next] == ':';
    }
  return false;
}

bool is_read_meta_image_field(std::string_view name) {
  const std::string lower = lower_case(name);
  return std::ranges::find(read_fields, lower) != read_fields.end() || lower == "elementsize" ||
         lower == "rotation" || lower == "orientation";
}

bool ends_meta_image_header(std::string_view line) {
  const auto parsed = parse_line(line);
  return parsed && lower_case(parsed->name) == "elementdatafile" && !parsed->value.starts_with("LIST");
}

std::string plain_meta_image_header(std::string_view text) {
  TextChanges changes(text);
  while (!text.empty()) {
    const std::string_view rest = text;
    const auto line = parse_line(take_line(text));
    if (!line) continue;
    const std::string name = lower_case(line->name);
    if (name == "compresseddata") changes.replace(line->value, "False");
    if (name == "compresseddatasize") changes.replace(rest.substr(0, rest.size() - text.size()), "");
    if (name != "elementdatafile") continue;
    changes.replace(line->value, plain_name(line->value));
    break;
  }
  return changes.finish();
}

MetaImageHeader parse_meta_image_header(std::string_view text) {
  KeyValues pairs;
  const Fields fields = take_fields(text, pairs);
  if (const auto type = value_of(fields, "objecttype"); !type.empty() && type != "Image")
    refuse("ObjectType", type, "only images are supported");
  if (const auto binary = value_of(fields, "binarydata"); !binary.empty() && !is_true("BinaryData", binary))
    refuse("BinaryData", binary, "samples as text are not supported");
  if (const auto channels = value_of(fields, "elementnumberofchannels"); !channels.empty() && channels != "1")
    refuse("ElementNumberOfChannels", channels, "only one value a sample is supported");
  const auto [dims, volumes] = dims_of(fields);
  const SampleType type = type_of(value_of(fields, "elementtype"));
  const auto volume_bytes = sample_bytes(dims, type);
  std::uint64_t all = 0;
  if (!volume_bytes || __builtin_mul_overflow(*volume_bytes, static_cast<std::uint64_t>(volumes), &all) ||
      all > std::uint64_t{1} << 62)
    refuse("DimSize", value_of(fields, "dimsize"), "is beyond all memory");
  MetaImageHeader header;
  const std::size_t axes = words_of(value_of(fields, "dimsize")).size();
  header.rescale = rescale_of(fields, header);
  add_rescale(header.rescale, pairs);
  header.info = {dims, type, Metadata(geometry_of_header(fields, axes, header.warnings), pairs)};
  header.volumes = volumes;
  const auto order = value_of_one(fields, {"elementbyteordermsb", "binarydatabyteordermsb"}),
             other = value_of_one(fields, {"binarydatabyteordermsb", "elementbyteordermsb"});
  header.big_endian = is_true("ElementByteOrderMSB", order);
  if (is_true("BinaryDataByteOrderMSB", other) != header.big_endian && size_of(type) > 1)
    refuse("ElementByteOrderMSB", order, "contradicts BinaryDataByteOrderMSB");
  header.is_compressed = is_true("CompressedData", value_of(fields, "compresseddata"));
  if (const auto size = value_of(fields, "headersize"); !size.empty())
    header.header_size = integer_of("HeaderSize", size);
  header.data_files = data_files_of(value_of(fields, "elementdatafile"), text, volumes, dims.z);
  if (header.header_size < -1 || header.header_size > std::int64_t{1} << 62 ||
      (header.header_size == -1 && (header.is_compressed || header.data_files.empty())))
    refuse("HeaderSize", value_of(fields, "headersize"), "is not possible here");
  if (header.data_files.size() > 1 && header.is_compressed)
    refuse("ElementDataFile", value_of(fields, "elementdatafile"),
           "several files with compressed samples are not supported");
  return header;
}

// MetaImage volumes from files.

namespace {

constexpr TextHeaderFormat meta_image = {.name = "MetaImage",
                                         .most_bytes = max_meta_image_header_bytes,
                                         .is_last = ends_meta_image_header,
                                         .plain = plain_meta_image_header};

MetaImageHeader read_header(FileBytes& file) {
  const std::string text = read_header_text(file, meta_image);
  try {
    return parse_meta_image_header(text);
  } catch (const BrokenInput& broken) {
    throw BrokenInput("{}: {}", file.name(), broken.what());
  }
}

/// The samples of `facts` after `before` others. The file is where its samples begin, or the header before
/// them.
std::unique_ptr<VolumeSource> open_samples(std::unique_ptr<FileBytes> file, const MetaImageHeader& header,
                                           SourceFacts facts, std::uint64_t before,
                                           std::uint64_t header_bytes, const std::string& path) {
  const std::uint64_t own = *sample_bytes(facts.info.dims, facts.info.type),
                      bytes = own * static_cast<std::uint64_t>(header.volumes);
  const bool is_last = before + own == bytes;
  SamplesPlace place{.start = file->position(),
                     .big_endian = header.big_endian,
                     .may_go_on = !is_last,
                     .header_bytes = header_bytes};
  if (header.header_size > 0) {
    place.start += static_cast<std::uint64_t>(header.header_size);
  } else if (header.header_size == -1) {
    if (file->size() && *file->size() > bytes) place.start = *file->size() - bytes;
  }
  if (!header.is_compressed) {
    place.start += before;
    if (is_last) allow_more(*file, place, facts);
    return plain_samples(std::move(facts), std::move(file), place);
  }
  const auto end = facts.files.size() == 1 ? std::optional(place.start) : std::nullopt;
  return compressed_samples(std::move(facts), std::move(file), place, before,
                            [path, end] { return plain_header(path, meta_image, end); });
}

}  // namespace

std::unique_ptr<VolumeSource> open_meta_image(std::unique_ptr<FileBytes> file, const std::string& path,
                                              const SourceDescription& source) {
  const std::string name = file->name();
  MetaImageHeader header = read_header(*file);
  const std::optional<std::int64_t> number = wanted_volume(source, name, header.info, header.volumes);
  const std::uint64_t before =
      static_cast<std::uint64_t>(number.value_or(0)) * *sample_bytes(header.info.dims, header.info.type);
  SourceFacts facts;
  facts.info = header.info;
  if (!number) take_all_volumes(facts.info, std::exchange(header.volumes, 1));
  facts.files = {path};
  facts.rescale = header.rescale;
  for (const std::string& warning : header.warnings) facts.warnings.push_back(name + ": " + warning);
  if (!header.scale_doubt.empty()) facts.scale_doubt = name + ": " + header.scale_doubt;
  facts.holds_other_bytes = true;  // fields of the header are kept, but not the header
  if (header.data_files.empty())
    return open_samples(std::move(file), header, std::move(facts), before, 0, path);
  const std::uint64_t header_bytes = file->position();
  file.reset();
  const std::vector<std::string> data_files = std::exchange(header.data_files, {});
  return open_data_files(
      meta_image, std::move(facts), path, name, header_bytes, data_files, source.data_outside,
      [=](std::unique_ptr<FileBytes> data, SourceFacts of_file, std::uint64_t bytes_of_header) {
        return open_samples(std::move(data), header, std::move(of_file), before, bytes_of_header, path);
      });
}

// MetaImage headers of volumes that are written.

namespace {

/// From the space of the volume to left-posterior-superior: the sign of each axis of the world.
std::array<double, 3> signs_of(const Geometry& geometry) {
  const auto signs = signs_of_space(geometry.space);
  if (!signs) return {1, 1, 1};
  return {-1.0 * (*signs)[0], -1.0 * (*signs)[1], 1.0 * (*signs)[2]};
}

std::string geometry_lines(const Geometry& geometry) {
  std::array<double, 3> spacing;
  for (std::size_t axis = 0; axis < 3; ++axis) spacing[axis] = spacing_or_1(geometry, axis);
  std::string lines;
  if (geometry.has_directions || geometry.has_origin || geometry.origin != Geometry().origin) {
    const std::array<double, 3> signs = signs_of(geometry);
    std::array<double, 9> matrix = {};
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::size_t row = 0; row < 3; ++row) {
        const double direction =
            geometry.has_directions ? geometry.directions[axis][row] / spacing[axis] : axis == row;
        matrix[3 * axis + row] = direction == 0 ? 0 : direction * signs[row];
      }
    lines += fmt::format("TransformMatrix = {}\n", fmt::join(matrix, " "));
    std::array<double, 3> origin;
    for (std::size_t row = 0; row < 3; ++row)
      origin[row] = geometry.origin[row] == 0 ? 0 : geometry.origin[row] * signs[row];
    lines += fmt::format("Offset = {}\n", fmt::join(origin, " "));
  }
  if (geometry.has_spacing || !lines.empty())
    lines += fmt::format("ElementSpacing = {}\n", fmt::join(spacing, " "));
  return lines;
}

/// True if a MetaImage source had this unit: other programs have already read these numbers with it.
bool has_unit_of_source(const VolumeInfo& info) {
  const std::string unit = info.metadata.text_of("metaimage_DistanceUnits");
  return !unit.empty() && info.geometry().units == std::array{unit, unit, unit};
}

/// In millimeters if the units are known, because ITK and its users take all lengths as millimeters.
Geometry geometry_in_file(const VolumeInfo& info) {
  if (has_unit_of_source(info) || !common_unit(info.geometry()).is_known) return info.geometry();
  return in_unit(info.geometry(), "mm");
}

std::string header_of(const VolumeInfo& info, const std::string& data_file) {
  const Geometry geometry = geometry_in_file(info);
  std::string text = fmt::format(
      "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = "
      "False\n");
  text += geometry_lines(geometry);
  std::string slope, intercept;
  bool has_slopes_of_slices = false;
  for (const auto& [key, value] : info.metadata.pairs()) {
    constexpr std::string_view ours = "metaimage_";
    has_slopes_of_slices = has_slopes_of_slices || key == "slice_slopes";
    if (key == "rescale_slope") slope = value;
    if (key == "rescale_intercept") intercept = value;
    if (key == lossy_source_key && value.find('\n') == value.npos)
      text += fmt::format("{} = {}\n", meta_image_loss, value);
    // A value is the rest of its line.
    if (!key.starts_with(ours) || value.find('\n') != value.npos) continue;
    const std::string name = key.substr(ours.size());
    if (lower_case(name).starts_with("elementtointensityfunction") || is_read_meta_image_field(name))
      continue;
    if (name == "DistanceUnits" && !has_unit_of_source(info)) continue;
    text += fmt::format("{} = {}\n", name, value);
  }
  if (!has_unit_of_source(info) && common_unit(geometry).is_known) text += "DistanceUnits = mm\n";
  if (!slope.empty() && !has_slopes_of_slices)
    text += fmt::format("ElementToIntensityFunctionSlope = {}\nElementToIntensityFunctionOffset = {}\n",
                        slope, intercept);
  text += fmt::format("DimSize = {} {} {}\nElementType = {}\nElementDataFile = {}\n", info.dims.x,
                      info.dims.y, info.dims.z, meta_image_name_of(info.type), data_file);
  return text;
}

}  // namespace

std::string meta_image_header_text(const VolumeInfo& info) { return header_of(info, "LOCAL"); }

std::string detached_meta_image_header(const VolumeInfo& info, const std::string& data_file) {
  std::string text = header_of(info, data_file);
  // Some names have another meaning in a header.
  if (parse_meta_image_header(text).data_files == std::vector{data_file}) return text;
  throw UsageError(tagrid::quoted(data_file) +
                   ": a MetaImage header cannot refer to a file of this name; choose another name");
}

std::vector<std::string> lost_in_meta_image(const VolumeInfo& info) {
  return lost_places(
      info.geometry(),
      {.name = "MetaImage",
       .space = "left-posterior-superior",
       .unknown_unit = "the numbers are written as they are, and programs take them for millimeters"});
}

}  // namespace tagrid
