#include "io/formats/nrrd/header.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <map>
#include <numeric>
#include <optional>

#include "io/errors/errors.h"
#include "io/files/slice_files.h"
#include "io/formats/nrrd/axes.h"
#include "io/metadata/text.h"
#include "io/text/text.h"
#include "io/volume/sample_places.h"

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
  throw BrokenInput(fmt::format("NRRD header: {}: {}: {}", field, quoted(value), why));
}

std::string_view required(const Fields& fields, std::string_view name) {
  const auto found = fields.find(name);
  if (found == fields.end()) throw BrokenInput(fmt::format("NRRD header: the field \"{}\" is missing", name));
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
      throw BrokenInput(fmt::format("NRRD header: \"{}\" is given twice", parsed.field));
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

}  // namespace tagrid
