#include "io/formats/npy/array.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/samples/file_samples.h"
#include "io/text/text.h"
#include "io/volume/one_of_volumes.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {
namespace {

using namespace std::string_view_literals;

constexpr std::string_view magic = npy_magic;
constexpr std::array types = {std::pair{"u1"sv, SampleType::uint8},   std::pair{"i1"sv, SampleType::int8},
                              std::pair{"u2"sv, SampleType::uint16},  std::pair{"i2"sv, SampleType::int16},
                              std::pair{"u4"sv, SampleType::uint32},  std::pair{"i4"sv, SampleType::int32},
                              std::pair{"f4"sv, SampleType::float32}, std::pair{"f8"sv, SampleType::float64}};

[[noreturn]] void refuse(std::string_view key, std::string_view value, std::string_view why) {
  throw BrokenInput("NumPy header: {} {}: {}", key, quoted(value), why);
}

/// The text of one value of a dictionary, with everything in its brackets; and what follows its comma.
std::pair<std::string_view, std::string_view> value_and_rest(std::string_view text) {
  int depth = 0;
  char quote = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quote != 0) {
      if (c == quote) quote = 0;
    } else if (c == '\'' || c == '"') {
      quote = c;
    } else if (c == '(' || c == '[' || c == '{') {
      ++depth;
    } else if (depth == 0 && (c == ',' || c == '}')) {
      return {trimmed(text.substr(0, i)), text.substr(c == ',' ? i + 1 : i)};
    } else if (c == ')' || c == ']' || c == '}') {
      --depth;
    }
  }
  throw BrokenInput("NumPy header: it has no end: " + quoted(text));
}

/// The text between quotes; nothing if `value` is something else.
std::optional<std::string_view> unquoted(std::string_view value) {
  if (value.size() < 2 || (value[0] != '\'' && value[0] != '"') || value.back() != value[0]) return {};
  return value.substr(1, value.size() - 2);
}

struct Fields {
  std::optional<std::string_view> kind, order, shape;
};

Fields fields_of(std::string_view dictionary) {
  std::string_view rest = trimmed(dictionary.substr(0, dictionary.find_last_not_of(" \n\r\0"sv) + 1));
  Fields fields;
  if (!rest.starts_with('{')) throw BrokenInput("NumPy header: " + quoted(rest) + " is not a dictionary");
  rest.remove_prefix(1);
  while (!(rest = trimmed(rest)).starts_with('}')) {
    const std::size_t colon = rest.find(':');
    const auto key = unquoted(trimmed(rest.substr(0, colon)));
    if (colon == rest.npos || !key) throw BrokenInput("NumPy header: no key at " + quoted(rest));
    std::string_view value;
    std::tie(value, rest) = value_and_rest(rest.substr(colon + 1));
    std::optional<std::string_view>* field = *key == "descr"           ? &fields.kind
                                             : *key == "fortran_order" ? &fields.order
                                             : *key == "shape"         ? &fields.shape
                                                                       : nullptr;
    if (field == nullptr || field->has_value()) refuse(*key, value, "is unknown, or is given twice");
    *field = value;
  }
  if (trimmed(rest) != "}") throw BrokenInput("NumPy header: something follows it: " + quoted(rest));
  if (!fields.kind || !fields.order || !fields.shape)
    throw BrokenInput("NumPy header: it must have descr, fortran_order and shape");
  return fields;
}

/// What a type that is not supported is, and what to do about it.
std::string why_not(std::string_view type) {
  if (type == "b1") return R"(booleans are not supported; save the array as .astype("uint8"))";
  if (type == "f2") return R"(floats of 16 bits are not supported; save the array as .astype("float32"))";
  if (type == "i8" || type == "u8")
    return R"(integers of 64 bits are not supported; save the array as .astype("int32") if its values fit)";
  if (type.starts_with('c')) return "complex numbers are not supported; save their real part or magnitude";
  return "only integers of 8, 16 and 32 bits and floats of 32 and 64 bits are supported";
}

/// The type and the byte order.
std::pair<SampleType, bool> type_of(std::string_view value) {
  const auto kind = unquoted(value);
  if (!kind) refuse("descr", value, "records are not supported; save one field of them");
  const char order = kind->empty() ? ' ' : kind->front();
  const std::string_view name = kind->substr(std::min<std::size_t>(1, kind->size()));
  const auto found = std::ranges::find(types, name, &std::pair<std::string_view, SampleType>::first);
  if (found == types.end()) refuse("descr", value, why_not(name));
  if (order != '<' && order != '>' && (order != '|' || size_of(found->second) > 1))
    refuse("descr", value, "its byte order must be < or >");
  return {found->second, order == '>'};
}

/// The lengths of axes, as the header has them.
std::vector<std::int64_t> lengths_of(std::string_view shape) {
  if (!shape.starts_with('(') || !shape.ends_with(')')) refuse("shape", shape, "must be a tuple");
  std::vector<std::int64_t> lengths;
  std::vector<std::string_view> words = split(shape.substr(1, shape.size() - 2), ',');
  if (trimmed(words.back()).empty()) words.pop_back();
  for (std::string_view word : words) {
    word = trimmed(word);
    if (word.ends_with('L')) word.remove_suffix(1);  // Python 2
    const auto length = whole_number_of(word);
    if (!length || *length < 1) refuse("shape", shape, "the lengths of axes must be positive");
    lengths.push_back(*length);
  }
  return lengths;
}

}  // namespace

NpyHeader parse_npy_header(std::string_view dictionary) {
  const Fields fields = fields_of(dictionary);
  NpyHeader header;
  std::tie(header.type, header.big_endian) = type_of(*fields.kind);
  std::vector<std::int64_t> lengths = lengths_of(*fields.shape);
  if (lengths.empty() || lengths.size() > 4)
    refuse("shape", *fields.shape,
           fmt::format("an array with {} axes is not a volume; 1 to 4 are supported", lengths.size()));
  if (*fields.order == "False")
    std::ranges::reverse(lengths);
  else if (*fields.order != "True")
    refuse("fortran_order", *fields.order, "must be True or False");
  lengths.resize(4, 1);
  header.dims = {lengths[0], lengths[1], lengths[2]};
  header.volumes = lengths[3];
  const auto bytes = sample_bytes(header.dims, header.type);
  std::uint64_t all = 0;
  if (!bytes || !is_volume_size(header.dims) ||
      __builtin_mul_overflow(*bytes, static_cast<std::uint64_t>(header.volumes), &all) ||
      all > std::uint64_t{1} << 62)
    refuse("shape", *fields.shape, "is beyond all memory");
  return header;
}

std::unique_ptr<VolumeSource> open_npy(std::unique_ptr<FileBytes> file, const std::string& path,
                                       const SourceDescription& source) {
  const std::string name = file->name();
  const std::string_view first = file->peek(magic.size() + 6);
  const int version = first.size() > magic.size() ? first[magic.size()] : 0;
  if (!first.starts_with(magic) || version < 1 || version > 3)
    throw BrokenInput("{}: version {} of NumPy's format is unknown", name, version);
  const std::size_t before = magic.size() + (version == 1 ? 4 : 6);
  if (first.size() < before) throw BrokenInput(name + ": ends within its header");
  const auto* length_bytes = reinterpret_cast<const std::byte*>(first.data()) + magic.size() + 2;
  const std::size_t length = version == 1 ? load_little_endian<std::uint16_t>(length_bytes)
                                          : load_little_endian<std::uint32_t>(length_bytes);
  if (length > max_npy_header_bytes)
    throw BrokenInput("{}: its header has {} bytes, more than the {} that are read", name, length,
                      max_npy_header_bytes);
  file->skip(before);
  std::string dictionary(length, '\0');
  if (file->read(reinterpret_cast<std::byte*>(dictionary.data()), length) != length)
    throw BrokenInput(name + ": ends within its header");
  NpyHeader header;
  try {
    header = parse_npy_header(dictionary);
  } catch (const BrokenInput& broken) {
    throw BrokenInput("{}: {}", name, broken.what());
  }
  SourceFacts facts;
  facts.info = {header.dims, header.type};
  facts.files = {path};
  const auto number = wanted_volume(source, name, facts.info, header.volumes);
  const std::uint64_t bytes = *sample_bytes(header.dims, header.type);
  SamplesPlace place{.start = before + length + static_cast<std::uint64_t>(number.value_or(0)) * bytes,
                     .big_endian = header.big_endian};
  if (number && *number + 1 < header.volumes) {
    place.may_go_on = true;
  } else {
    if (!number) take_all_volumes(facts.info, header.volumes);
    allow_more(*file, place, facts);
  }
  facts.holds_other_bytes = facts.holds_other_bytes || (number && header.volumes > 1);
  return plain_samples(std::move(facts), std::move(file), place);
}

std::string npy_header_bytes(const VolumeInfo& info) {
  const auto type = std::ranges::find(types, info.type, &std::pair<std::string_view, SampleType>::second);
  const Index3& dims = info.dims;
  const std::string volumes = info.volumes == 1 ? "" : fmt::format("{}, ", info.volumes);
  std::string text = fmt::format("{{'descr': '{}{}', 'fortran_order': False, 'shape': ({}{}, {}, {}), }}",
                                 size_of(info.type) == 1 ? '|' : '<', type->first, volumes,
                                 dims.z / info.volumes, dims.y, dims.x);
  // Blanks align the samples, as NumPy's do, so that arrays can be mapped into memory.
  constexpr std::size_t alignment = 64, before = 10;
  text.append(alignment - 1 - (before + text.size()) % alignment, ' ').push_back('\n');
  std::byte length[2];
  store_little_endian(length, static_cast<std::uint16_t>(text.size()));
  return fmt::format("{}\x01{}{}", magic, '\0', std::string_view(reinterpret_cast<const char*>(length), 2)) +
         text;
}

std::string lost_rescale_in_npy(const VolumeInfo& info) {
  return info.metadata.value("rescale_slope") ? "NumPy arrays have no place for slope and intercept" : "";
}

std::vector<std::string> lost_in_npy(const VolumeInfo& info) {
  const Geometry& geometry = info.geometry();
  std::vector<std::string_view> names;
  if (geometry.has_spacing) names.emplace_back("voxel size");
  if (geometry.has_origin) names.emplace_back("position");
  if (geometry.has_directions || !geometry.space.empty()) names.emplace_back("directions");
  if (names.empty()) return {};
  return {fmt::format("NumPy arrays have no place for the {}", fmt::join(names, ", "))};
}

}  // namespace tagrid
