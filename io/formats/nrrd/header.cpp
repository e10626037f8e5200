#include "io/formats/nrrd/header.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <optional>

#include "io/errors/errors.h"
#include "io/files/slice_files.h"
#include "io/formats/nrrd/axes.h"
#include "io/metadata/entries.h"
#include "io/metadata/fields.h"
#include "io/metadata/region.h"
#include "io/metadata/text.h"
#include "io/text/foreign_number.h"
#include "io/text/text.h"
#include "io/volume/sample_places.h"
#include "io/volume/volume_info.h"

namespace tagrid {
namespace {

using Fields = std::map<std::string_view, std::string_view>;

/// The name of a type in NRRD, which has no "float32".
std::string_view nrrd_name_of(SampleType type) {
  if (type == SampleType::float32) return "float";
  if (type == SampleType::float64) return "double";
  return name_of(type);
}

[[noreturn]] void refuse(std::string_view field, std::string_view value, std::string_view why) {
  throw BrokenInput("NRRD header: {}: {}: {}", field, quoted(value), why);
}

std::string_view required(const Fields& fields, std::string_view name) {
  const auto found = fields.find(name);
  if (found == fields.end()) throw BrokenInput("NRRD header: the field \"{}\" is missing", name);
  return found->second;
}

std::string_view optional(const Fields& fields, std::string_view name) {
  const auto found = fields.find(name);
  return found == fields.end() ? std::string_view() : found->second;
}

std::int64_t integer_of(std::string_view field, std::string_view text) {
  if (const auto number = whole_number_of(text)) return *number;
  refuse(field, text, "not a whole number");
}

SampleType type_of(std::string_view value) {
  static const std::map<SampleType, std::vector<std::string_view>> type_names = {
      {SampleType::int8, {"signed char", "int8", "int8_t"}},
      {SampleType::uint8, {"uchar", "unsigned char", "uint8", "uint8_t"}},
      {SampleType::int16, {"short", "short int", "signed short", "signed short int", "int16", "int16_t"}},
      {SampleType::uint16, {"ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"}},
      {SampleType::int32, {"int", "signed int", "int32", "int32_t"}},
      {SampleType::uint32, {"uint", "unsigned int", "uint32", "uint32_t"}},
      {SampleType::float32, {"float"}},
      {SampleType::float64, {"double"}}};
  const std::string name = lower_case(fmt::format("{}", fmt::join(words_of(value), " ")));
  for (const auto& [type, spellings] : type_names)
    if (std::ranges::find(spellings, name) != spellings.end()) return type;
  refuse("type", value, "not supported; use integers of 8, 16 or 32 bits, float or double");
}

/// The sizes of all axes of the file, fastest first.
std::vector<std::int64_t> sizes_of(const Fields& fields) {
  const std::string_view dimension = required(fields, "dimension");
  const std::int64_t axes = integer_of("dimension", dimension);
  if (axes < 2 || axes > max_nrrd_axes)
    refuse("dimension", dimension, fmt::format("a volume in a file has 2 to {} axes", max_nrrd_axes));
  const std::string_view value = required(fields, "sizes");
  std::vector<std::int64_t> sizes;
  for (const std::string_view word : words_of(value)) sizes.push_back(integer_of("sizes", word));
  if (static_cast<std::int64_t>(sizes.size()) != axes)
    refuse("sizes", value, fmt::format("must be {} numbers", axes));
  if (std::ranges::min(sizes) < 1) refuse("sizes", value, "must be positive");
  return sizes;
}

NrrdHeader::Encoding encoding_of(std::string_view value) {
  const std::string name = lower_case(value);
  if (name == "raw") return NrrdHeader::Encoding::raw;
  if (name == "gzip" || name == "gz") return NrrdHeader::Encoding::gzip;
  if (name == "bzip2" || name == "bz2") return NrrdHeader::Encoding::bzip2;
  refuse("encoding", value, "not supported; use raw, gzip or bzip2");
}

bool big_endian_of(const Fields& fields, SampleType type) {
  const std::string name =
      lower_case(size_of(type) > 1 ? required(fields, "endian") : optional(fields, "endian"));
  if (!name.empty() && name != "little" && name != "big") refuse("endian", name, "must be little or big");
  return name == "big";
}

/// "LIST 2": one name a line follows; the number of axes of a file is optional.
bool is_list(const std::vector<std::string_view>& words) { return !words.empty() && words[0] == "LIST"; }

std::optional<FilePattern> pattern_of(std::string_view name) {
  try {
    return file_pattern(name);
  } catch (const BrokenInput& error) {
    refuse("data file", name, error.what());
  }
}

/// "slice%03d.raw 1 300 1 2": the names, the first and the last number, the step and, optionally, the axes of
/// a file. A line like this without numbers is a plain name.
bool is_numbered(const std::vector<std::string_view>& words) {
  return words.size() >= 4 && pattern_of(words[0]);
}

std::vector<std::string> numbered_files(std::string_view value, const std::vector<std::string_view>& words) {
  const std::int64_t first = integer_of("data file", words[1]), last = integer_of("data file", words[2]),
                     step = integer_of("data file", words[3]);
  try {
    return pattern_of(words[0])->names(first, last, step, max_nrrd_data_files);
  } catch (const BrokenInput& error) {
    refuse("data file", value, error.what());
  }
}

/// The data files of a volume; `list` is what follows a line "data file: LIST", and `sizes` are those of all
/// axes.
std::vector<std::string> data_files_of(const Fields& fields, std::string_view list,
                                       const std::vector<std::int64_t>& sizes, Index3 dims) {
  if (!fields.contains("data file")) return {};
  const std::string_view value = required(fields, "data file");
  const auto words = words_of(value);
  if (words.empty()) refuse("data file", value, "must name a file");
  if (!is_list(words) && !is_numbered(words)) return {std::string(value)};
  std::vector<std::string> names;
  if (is_list(words))
    for (std::string_view line = take_line(list); !line.empty(); line = take_line(list))
      names.emplace_back(line);
  else
    names = numbered_files(value, words);
  const std::size_t numbers = is_list(words) ? 1 : 4;
  if (words.size() > numbers + 1) refuse("data file", value, "more follows than the number of axes");
  const auto all = static_cast<std::int64_t>(sizes.size());
  const std::int64_t axes = words.size() > numbers ? integer_of("data file", words[numbers]) : all - 1;
  // A file holds whole slices.
  if (axes < 2 || axes > all)
    refuse("data file", value, fmt::format("a file must have 2 to {} axes of the volume", all));
  const auto count = static_cast<std::int64_t>(names.size());
  if (count == 0) refuse("data file", value, "no file is named");
  if (count > max_nrrd_data_files)
    refuse("data file", value, fmt::format("more than {} files", max_nrrd_data_files));
  if ((axes < all &&
       count != std::accumulate(sizes.begin() + axes, sizes.end(), std::int64_t{1}, std::multiplies())) ||
      dims.z % count != 0)
    refuse("data file", value,
           fmt::format("{} files cannot hold the {} slices of the volume, {}", count, dims.z,
                       axes < all ? "one in each" : "equally many in each"));
  return names;
}

void read_skips(const Fields& fields, NrrdHeader& header) {
  if (fields.contains("line skip")) header.line_skip = integer_of("line skip", optional(fields, "line skip"));
  if (fields.contains("byte skip")) header.byte_skip = integer_of("byte skip", optional(fields, "byte skip"));
  if (header.line_skip < 0) refuse("line skip", optional(fields, "line skip"), "must not be negative");
  if (header.byte_skip < -1 || (header.byte_skip == -1 && header.encoding != NrrdHeader::Encoding::raw))
    refuse("byte skip", optional(fields, "byte skip"), "must not be negative, except -1 with encoding raw");
}

/// Sorts the lines after the magic: storage fields to the result, all others, as they are, to `others`. What
/// follows "data file: LIST" goes to `list`.
Fields storage_fields_of(std::string_view text, MetadataEntries& others, std::string_view& list) {
  Fields fields;
  while (!text.empty()) {
    const std::string_view line = take_line(text);
    if (line.empty()) break;
    const MetadataEntry parsed = entry_of_line(line);
    if (parsed.kind != MetadataEntry::Kind::field || !is_storage_field(parsed.field)) {
      others.add(parsed);
    } else if (!fields.emplace(parsed.field, parsed.value).second) {
      throw BrokenInput("NRRD header: \"{}\" is given twice", parsed.field);
    }
    if (parsed.field == "data file" && is_list(words_of(parsed.value))) {
      list = text;
      break;
    }
  }
  return fields;
}

}  // namespace

bool begins_nrrd(std::string_view bytes) {
  return bytes.starts_with("NRRD") && bytes.size() >= 9 &&
         std::all_of(bytes.begin() + 4, bytes.begin() + 8, [](char c) { return c >= '0' && c <= '9'; }) &&
         (bytes[8] == '\n' || bytes[8] == '\r');
}

NrrdHeader parse_nrrd_header(std::string_view text) {
  const std::string_view magic = take_line(text);
  if (!magic.starts_with("NRRD000") || magic.size() != 8 || magic[7] < '1' || magic[7] > '5')
    throw BrokenInput("NRRD header: " + quoted(magic) +
                      " is not a supported version; use NRRD0001 to NRRD0005");
  NrrdHeader header;
  MetadataEntries others;
  std::string_view list;
  const Fields fields = storage_fields_of(text, others, list);
  header.info.type = type_of(required(fields, "type"));
  const std::vector<std::int64_t> sizes = sizes_of(fields);
  ThreeAxes axes = three_axes(sizes, others);
  header.info.dims = axes.dims;
  if (!sample_bytes(header.info.dims, header.info.type))
    refuse("sizes", required(fields, "sizes"),
           "must be positive, and the volume must be smaller than 2^62 bytes");
  header.encoding = encoding_of(required(fields, "encoding"));
  header.big_endian = big_endian_of(fields, header.info.type);
  header.data_files = data_files_of(fields, list, sizes, header.info.dims);
  read_skips(fields, header);
  header.info.metadata = with_spacing_of_ends(Metadata(std::move(axes.entries)), header.info.dims);
  return header;
}

std::string plain_nrrd_header(std::string_view text) {
  TextChanges changes(text);
  bool is_in_list = false;
  take_line(text);
  while (!text.empty()) {
    const std::string_view line = take_line(text);
    if (line.empty()) break;
    if (is_in_list) {
      changes.replace(line, plain_name(line));
      continue;
    }
    const MetadataEntry parsed = entry_of_line(line);
    if (parsed.field == "encoding") changes.replace(parsed.value, "raw");
    if (parsed.field != "data file") continue;
    const auto words = words_of(parsed.value);
    is_in_list = is_list(words);
    if (!is_in_list) {
      const std::string_view name = is_numbered(words) ? words[0] : parsed.value;
      changes.replace(name, plain_name(name));
    }
  }
  return changes.finish();
}

std::string nrrd_header_text(const VolumeInfo& info, std::string_view data_file) {
  const bool needs_version_5 = std::ranges::any_of(
      info.metadata.entries(), [](const MetadataEntry& entry) { return entry.field == "measurement frame"; });
  // Fields with a value for each axis must come after the dimension, so the source's lines come last.
  std::string text =
      fmt::format("NRRD000{}\ntype: {}\ndimension: 3\nsizes: {} {} {}\nencoding: raw\n",
                  needs_version_5 ? 5 : 4, nrrd_name_of(info.type), info.dims.x, info.dims.y, info.dims.z);
  if (size_of(info.type) > 1) text += "endian: little\n";
  text += text_of(info.metadata);
  if (data_file.empty()) return text + "\n";
  return text + fmt::format("data file: {}\n", data_file);
}

std::string detached_nrrd_header(const VolumeInfo& info, const std::string& data_file) {
  // The name is the rest of a line, without quotes. Some names have another meaning there.
  const std::string text = nrrd_header_text(info, data_file);
  try {
    if (parse_nrrd_header(text).data_files == std::vector{data_file}) return text;
  } catch (const BrokenInput&) {
    // The name cannot be stored in a header.
  }
  throw UsageError(tagrid::quoted(data_file) +
                   ": a detached header cannot refer to a file of this name; choose another name");
}

namespace {

using Vectors = std::vector<std::vector<double>>;

bool is_unknown(std::string_view word) {
  const auto number = number_of(word);
  return number && std::isnan(*number);
}

/// Reads the lines of a header, from front to back.
class Reading {
 public:
  Reading(std::string_view text, const std::vector<MetadataEntry>& lines) : changes_(text) {
    for (const MetadataEntry& entry : lines) {
      has_spacings_ = has_spacings_ || entry.field == "spacings";
      if (entry.field == "dimension" && axes_ == 0)
        axes_ = static_cast<std::size_t>(std::max<std::int64_t>(whole_number_of(entry.value).value_or(0), 0));
    }
  }

  void read_field(const MetadataEntry& entry) {
    if (entry.field == "spacings")
      read_numbers(entry, "the spacing along this axis is unknown", true);
    else if (entry.field == "axis mins")
      read_numbers(entry, "the position along this axis is unknown", false);
    else if (entry.field == "axis maxs" || entry.field == "thicknesses")
      read_numbers(entry, "it is left out", false);
    else if (entry.field == "space directions")
      read_directions(entry);
    else if (entry.field == "space origin")
      read_origin(entry);
    else if (entry.field == "old min" || entry.field == "old max")
      read_old_range(entry);
    else if (entry.field == "block size")
      read_block_size(entry);
  }

  void read_pair(const MetadataEntry& entry) {
    const std::string_view key = entry.key, value = entry.value;
    if (key == slice_positions_key) read_positions(value);
    if (is_of_a_label(key)) read_label(key);
    if (key != "rescale_slope" && key != "rescale_intercept") return;
    // The line of an unreadable number stays, so that the doubt does, too; see doubt_of_rescale().
    const ForeignNumber number = foreign_number(value);
    if (!number.decimal_comma) return;
    warn(remark_on(number, key, ""));
    changes_.replace(value, fmt::format("{}", number.value));
  }

  ForeignNrrdHeader finish() {
    result_.text = changes_.finish();
    return std::move(result_);
  }

 private:
  void warn(const std::string& sentence) { result_.warnings.push_back("NRRD header: " + sentence); }
  void comment_out(const MetadataEntry& entry) {
    changes_.replace(entry.line, fmt::format("# {}", entry.line));
  }

  /// A field with a number for each axis.
  void read_numbers(const MetadataEntry& entry, std::string_view consequence, bool is_length) {
    const ForeignNumbers numbers = foreign_numbers(entry.value, axes_);
    const auto words = words_of(entry.value);
    if (numbers.numbers.empty()) {
      warn(remark_on(numbers, entry.field, "it is left out"));
      return comment_out(entry);
    }
    for (std::size_t axis = 0; axis < axes_; ++axis) {
      const ForeignNumber& number = numbers.numbers[axis];
      if (is_unknown(words[axis])) continue;
      const bool is_zero = is_length && number.is_number() && number.value == 0;
      std::string remark =
          remark_on(number, fmt::format("of {} {}, number {}", entry.field, quoted(entry.value), axis + 1),
                    consequence);
      if (is_zero)
        remark = fmt::format("of {} {}, number {} is 0; {}", entry.field, quoted(entry.value), axis + 1,
                             consequence);
      if (remark.empty()) continue;
      warn(remark);
      changes_.replace(words[axis],
                       is_zero || number.is_unreadable() ? "nan" : fmt::format("{}", number.value));
    }
  }

  /// The vectors of all axes; "none" is an empty one. Nothing if they are not like that.
  std::optional<Vectors> directions_in(std::string_view value) const {
    const auto parts = vectors_in(value);
    if (!parts || parts->size() != axes_) return std::nullopt;
    Vectors vectors;
    std::size_t size = 0;
    for (const std::string_view part : *parts) {
      if (lower_case(part) == "none") {
        vectors.emplace_back();
        continue;
      }
      auto vector = vector_of(part);
      if (!vector || std::ranges::any_of(*vector, [](double n) { return std::isinf(n); }))
        return std::nullopt;
      // A vector of NaN is an unknown one, and refused as "none" is.
      const auto unknown = std::ranges::count_if(*vector, [](double n) { return std::isnan(n); });
      if (unknown != 0 && unknown != std::ssize(*vector)) return std::nullopt;
      if (size != 0 && vector->size() != size) return std::nullopt;
      size = vector->size();
      vectors.push_back(std::move(*vector));
    }
    return vectors;
  }

  /// False if axes have directions that lie in a line or a plane.
  static bool span(const Vectors& directions) {
    Vectors vectors;
    for (const auto& vector : directions)
      if (!vector.empty() && !std::isnan(vector[0])) vectors.push_back(vector);
    for (auto& vector : vectors) vector.resize(3);
    if (vectors.size() == 3) {
      std::array<std::array<double, 3>, 3> matrix;
      for (std::size_t axis = 0; axis < 3; ++axis) std::ranges::copy(vectors[axis], matrix[axis].begin());
      const double volume = determinant(matrix);
      return volume != 0 && std::isfinite(volume);
    }
    if (vectors.size() != 2) return true;
    const auto &u = vectors[0], &v = vectors[1];
    return u[1] * v[2] != u[2] * v[1] || u[2] * v[0] != u[0] * v[2] || u[0] * v[1] != u[1] * v[0];
  }

  void read_directions(const MetadataEntry& entry) {
    const auto directions = directions_in(entry.value);
    if (!directions) {
      warn(
          fmt::format("space directions {} are not {} vectors of numbers; spacing and directions are unknown",
                      quoted(entry.value), axes_));
      return comment_out(entry);
    }
    if (span(*directions)) return;
    warn(
        fmt::format("space directions {} do not span a volume; directions are unknown", quoted(entry.value)));
    if (has_spacings_) return comment_out(entry);
    std::vector<double> lengths;
    for (const auto& vector : *directions) {
      double sum = 0;
      for (const double number : vector) sum += number * number;
      lengths.push_back(sum > 0 && std::isfinite(sum) ? std::sqrt(sum) : Geometry::unknown);
    }
    changes_.replace(entry.line, fmt::format("spacings: {}", fmt::join(lengths, " ")));
  }

  void read_origin(const MetadataEntry& entry) {
    const auto origin = vector_of(entry.value);
    const auto unknown = origin ? std::ranges::count_if(*origin, [](double n) { return std::isnan(n); }) : 0;
    const bool is_readable = origin && (origin->size() == 3 || (origin->size() == 2 && axes_ == 2)) &&
                             std::ranges::none_of(*origin, [](double n) { return std::isinf(n); }) &&
                             (unknown == 0 || unknown == std::ssize(*origin));
    if (is_readable) return;
    warn(fmt::format("space origin {} is not a vector of numbers; where the volume lies is unknown",
                     quoted(entry.value)));
    comment_out(entry);
  }

  /// "Segment0_LabelValue": 3D Slicer says so that samples of this number belong to a segment.
  static bool is_of_a_label(std::string_view key) {
    constexpr std::string_view before = "Segment", after = "_LabelValue";
    if (!key.starts_with(before) || !key.ends_with(after) || key.size() <= before.size() + after.size())
      return false;
    return std::ranges::all_of(key.substr(before.size(), key.size() - before.size() - after.size()),
                               is_digit);
  }
  /// Said once, however many labels there are.
  void read_label(std::string_view key) {
    if (has_labels_) return;
    has_labels_ = true;
    result_.not_understood.push_back(fmt::format(
        "NRRD header: {} says that samples are labels, but they will be treated as intensities", key));
  }

  void read_positions(std::string_view list) {
    for (const std::string_view position : positions_in(list))
      if (const ForeignNumbers numbers = foreign_numbers(position, 3); !numbers.are_numbers())
        return warn(remark_on(numbers, "of slice_positions,", "where this slice lies is unknown"));
  }

  /// Programs that quantize values note what range they had.
  void read_old_range(const MetadataEntry& entry) {
    if (is_unknown(entry.value)) return;
    result_.not_understood.push_back(
        fmt::format("NRRD header: {} {} says that samples are quantized values; they are taken as they are, "
                    "and not turned back",
                    entry.field, quoted(entry.value)));
    if (foreign_number(entry.value).is_unreadable()) comment_out(entry);
  }

  /// Blocks are refused by their type. Beside another one, teem reads no file with this field.
  void read_block_size(const MetadataEntry& entry) {
    warn(fmt::format("block size {}: samples are no blocks; it is left out", quoted(entry.value)));
    comment_out(entry);
  }

  TextChanges changes_;
  std::size_t axes_ = 0;  ///< 0 if the header does not say it
  bool has_spacings_ = false, has_labels_ = false;
  ForeignNrrdHeader result_;
};

/// The lines after the magic, up to the blank line or the names of files.
std::vector<MetadataEntry> lines_in(std::string_view text) {
  std::vector<MetadataEntry> lines;
  take_line(text);
  while (!text.empty()) {
    const std::string_view line = take_line(text);
    if (line.empty()) break;
    lines.push_back(entry_of_line(line));
    if (lines.back().field == "data file" && lines.back().value.starts_with("LIST")) break;
  }
  return lines;
}

}  // namespace

ForeignNrrdHeader foreign_nrrd_header(std::string_view text) {
  const std::vector<MetadataEntry> lines = lines_in(text);
  Reading reading(text, lines);
  for (const MetadataEntry& entry : lines)
    if (entry.kind == MetadataEntry::Kind::field)
      reading.read_field(entry);
    else if (entry.kind == MetadataEntry::Kind::pair)
      reading.read_pair(entry);
  return reading.finish();
}

}  // namespace tagrid
