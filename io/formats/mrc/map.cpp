#include "io/formats/mrc/map.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/metadata/foreign_geometry.h"
#include "io/samples/file_samples.h"
#include "io/text/text.h"
#include "io/volume/given_spacing.h"
#include "io/volume/one_of_volumes.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {
namespace {

// The bytes at which fields begin.
constexpr std::size_t size_at = 0, mode_at = 12, start_at = 16, intervals_at = 28, cell_at = 40,
                      angles_at = 52, axes_at = 64, least_at = 76, most_at = 80, space_group_at = 88,
                      extended_at = 92, kind_at = 104, version_at = 108, imod_at = 152, flags_at = 156,
                      origin_at = 196, word_at = 208, stamp_at = 212, labels_at = 224, label_bytes = 80,
                      most_labels = 10;
constexpr std::int32_t imod_stamp = 0x444f4d49;  // "IMOD"
constexpr std::int32_t bytes_are_signed = 1, origin_is_inverted = 4, bytes_are_halves = 16;
// From this space group on, a file is a stack of volumes with one slice for each interval along z.
constexpr std::int32_t first_of_stacks = 401, last_of_stacks = 630;

/// The numbers of a header in one byte order.
class Numbers {
 public:
  Numbers(std::string_view bytes, bool big_endian) : bytes_(bytes), big_endian_(big_endian) {}

  std::int32_t integer(std::size_t at) const { return static_cast<std::int32_t>(bits(at)); }
  /// The decimal number that was meant: 0.1 and not 0.10000000149.
  double decimal(std::size_t at) const {
    const float number = std::bit_cast<float>(bits(at));
    return std::isfinite(number) ? number_of(fmt::format("{}", number)).value_or(number) : number;
  }
  std::array<std::int32_t, 3> three_integers(std::size_t at) const {
    return {integer(at), integer(at + 4), integer(at + 8)};
  }
  std::array<double, 3> three_decimals(std::size_t at) const {
    return {decimal(at), decimal(at + 4), decimal(at + 8)};
  }
  bool big_endian() const { return big_endian_; }

  /// True if sizes and the type of samples may be meant like this.
  bool is_plausible() const {
    constexpr std::int32_t most_modes = 256;
    const auto sizes = three_integers(size_at);
    return std::ranges::all_of(sizes, [](std::int32_t size) { return size > 0; }) && integer(mode_at) >= 0 &&
           integer(mode_at) < most_modes;
  }

 private:
  std::uint32_t bits(std::size_t at) const {
    const auto number =
        load_little_endian<std::uint32_t>(reinterpret_cast<const std::byte*>(bytes_.data()) + at);
    return big_endian_ ? byte_swapped(number) : number;
  }

  std::string_view bytes_;
  bool big_endian_;
};

/// The machine stamp says the byte order, but some programs leave it out, or write a wrong one.
Numbers numbers_of(std::string_view bytes, std::vector<std::string>& warnings) {
  const bool says_big = bytes[stamp_at] == 0x11, says_little = bytes[stamp_at] == 0x44;
  const Numbers said(bytes, says_big), other(bytes, !says_big);
  if (said.is_plausible() || !other.is_plausible()) return said;
  if (says_big || says_little)
    warnings.push_back(fmt::format("its machine stamp is wrong: numbers are {} endian",
                                   other.big_endian() ? "big" : "little"));
  return other;
}

/// Whether bytes have a sign. MRC2014 says that they do; programs of the time before wrote both.
SampleType type_of_bytes(const Numbers& numbers, MrcHeader& header) {
  if (numbers.integer(imod_at) == imod_stamp) {
    if ((numbers.integer(flags_at) & bytes_are_halves) != 0)
      throw BrokenInput("samples of 4 bits (a flag of IMOD) are not supported");
    return (numbers.integer(flags_at) & bytes_are_signed) != 0 ? SampleType::int8 : SampleType::uint8;
  }
  constexpr std::int32_t of_2014 = 20140;
  const double least = numbers.decimal(least_at), most = numbers.decimal(most_at);
  if (least >= 0 && most > 127 && most <= 255) {
    if (numbers.integer(version_at) >= of_2014)
      header.warnings.push_back(fmt::format(
          "its bytes should have a sign, but it states a maximum of {}; they are read as uint8", most));
    return SampleType::uint8;
  }
  // With a range within 0 to 127, both are the same.
  const bool is_stated =
      numbers.integer(version_at) >= of_2014 || (least < most && least >= -128 && most <= 127);
  if (!is_stated)
    header.not_understood.emplace_back("does not state whether its bytes have a sign; they are read as int8");
  return SampleType::int8;
}

SampleType type_of(const Numbers& numbers, MrcHeader& header) {
  const std::int32_t mode = numbers.integer(mode_at);
  if (mode == 0) return type_of_bytes(numbers, header);
  if (mode == 1) return SampleType::int16;
  if (mode == 2) return SampleType::float32;
  if (mode == 6) return SampleType::uint16;
  const char* what = mode == 3 || mode == 4 ? "complex numbers"
                     : mode == 12           ? "floats of 16 bits"
                     : mode == 16           ? "colors"
                     : mode == 101          ? "samples of 4 bits"
                                            : "an unknown type";
  throw BrokenInput("samples of mode {} ({}) are not supported", mode, what);
}

/// The axis of the world along which columns, rows and sections lie.
std::array<std::size_t, 3> world_axes(const Numbers& numbers) {
  const auto stored = numbers.three_integers(axes_at);
  if (stored == std::array<std::int32_t, 3>{0, 0, 0}) return {0, 1, 2};
  std::array<std::size_t, 3> axes = {};
  std::array<bool, 3> seen = {};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::int32_t axis = stored[i];
    if (axis < 1 || axis > 3 || seen[static_cast<std::size_t>(axis - 1)])
      throw BrokenInput("its axes are {}, {}, {}; they must be 1, 2 and 3 in some order", stored[0],
                        stored[1], stored[2]);
    axes[i] = static_cast<std::size_t>(axis - 1);
    seen[axes[i]] = true;
  }
  return axes;
}

/// The position of the first sample; nothing if the header does not state it.
std::optional<std::array<double, 3>> position_of(const Numbers& numbers,
                                                 const std::array<std::size_t, 3>& axes,
                                                 const std::array<double, 3>& spacing) {
  std::array<double, 3> position = numbers.three_decimals(origin_at);
  if (std::ranges::any_of(position, [](double number) { return !std::isfinite(number); })) return {};
  const bool is_stated = std::ranges::any_of(position, [](double number) { return number != 0; });
  if (is_stated) {
    const bool is_of_imod = numbers.integer(imod_at) == imod_stamp;
    if (is_of_imod && (numbers.integer(flags_at) & origin_is_inverted) == 0)
      for (double& number : position) number = number == 0 ? 0 : -number;
    return position;
  }
  const auto first = numbers.three_integers(start_at);
  if (first == std::array<std::int32_t, 3>{0, 0, 0}) return {};
  for (std::size_t i = 0; i < 3; ++i) position[axes[i]] = first[i] * spacing[i];
  return position;
}

Geometry geometry_of(const Numbers& numbers, MrcHeader& header) {
  constexpr std::array names = {'x', 'y', 'z'};
  const auto axes = world_axes(numbers);
  const auto intervals = numbers.three_integers(intervals_at);
  const auto cell = numbers.three_decimals(cell_at);
  Geometry geometry;
  std::vector<ForeignNumber> distances;
  std::vector<std::string> fields;
  for (const std::size_t axis : axes) {
    // Programs that do not know the size of the cell leave it 0.
    const bool is_stated = intervals[axis] > 0 && cell[axis] != 0;
    distances.push_back(is_stated ? foreign_number(cell[axis] / intervals[axis]) : ForeignNumber());
    fields.push_back(fmt::format("the size of the cell along {}", names[axis]));
  }
  set_spacing(distances, fields, NegativeSpacing::is_unknown, geometry, header.warnings);
  if (geometry.has_spacing) geometry.units.fill("angstrom");
  const auto angles = numbers.three_decimals(angles_at);
  constexpr double right_angle = 90, rounding = 1e-3;
  if (std::ranges::any_of(angles, [](double a) { return a != 0 && !(std::abs(a - right_angle) < rounding); }))
    header.warnings.push_back(
        fmt::format("the angles of its cell are {}, {}, {}; they are read as 90 degrees", angles[0],
                    angles[1], angles[2]));
  if (has_unknown_spacing(geometry)) return geometry;
  const auto position = position_of(numbers, axes, geometry.spacing);
  const bool is_permuted = axes != std::array<std::size_t, 3>{0, 1, 2};
  if (!position && !is_permuted) return geometry;
  for (std::size_t i = 0; i < 3; ++i) geometry.directions[i][axes[i]] = geometry.spacing[i];
  geometry.has_directions = true;
  geometry.origin = position.value_or(std::array<double, 3>{});
  geometry.has_origin = position.has_value();
  return geometry;
}

/// The text of a field of fixed width.
std::string text_at(std::string_view bytes, std::size_t at, std::size_t size) {
  const std::string_view field = bytes.substr(at, size);
  return std::string(trimmed(field.substr(0, field.find('\0'))));
}

KeyValues pairs_of(std::string_view bytes) {
  KeyValues pairs;
  if (std::string kind = text_at(bytes, kind_at, 4); !kind.empty() && is_utf8(kind))
    pairs.emplace_back("mrc_exttyp", std::move(kind));
  for (std::size_t i = 0; i < most_labels; ++i)
    if (std::string label = text_at(bytes, labels_at + i * label_bytes, label_bytes); !label.empty())
      pairs.emplace_back(fmt::format("mrc_label_{}", i + 1), std::move(label));
  return pairs;
}

}  // namespace

MrcHeader parse_mrc_header(std::string_view bytes) {
  if (bytes.size() < mrc_header_bytes) throw BrokenInput("ends within its header");
  MrcHeader header;
  const Numbers numbers = numbers_of(bytes, header.warnings);
  header.big_endian = numbers.big_endian();
  const auto sizes = numbers.three_integers(size_at);
  header.info.dims = {sizes[0], sizes[1], sizes[2]};
  header.info.type = type_of(numbers, header);
  if (!sample_bytes(header.info.dims, header.info.type) || !is_volume_size(header.info.dims))
    throw BrokenInput("a volume cannot have {} samples", described(header.info.dims, header.info.type));
  const std::int32_t extended = numbers.integer(extended_at), space_group = numbers.integer(space_group_at),
                     slices = numbers.integer(intervals_at + 8);
  if (extended < 0) throw BrokenInput("its extended header has {} bytes", extended);
  header.start = mrc_header_bytes + static_cast<std::uint64_t>(extended);
  if (space_group >= first_of_stacks && space_group <= last_of_stacks) {
    if (slices < 1 || sizes[2] % slices != 0)
      throw BrokenInput("{} slices cannot be a stack of volumes with {} slices each", sizes[2], slices);
    header.volumes = sizes[2] / slices;
    header.info.dims.z = slices;
  }
  header.info.metadata = Metadata(geometry_of(numbers, header), pairs_of(bytes));
  return header;
}

bool begins_mrc(std::string_view bytes) {
  if (bytes.size() < stamp_at || bytes.substr(word_at, 3) != "MAP") return false;
  return bytes[word_at + 3] == ' ' || bytes[word_at + 3] == '\0';
}

std::unique_ptr<VolumeSource> open_mrc(std::unique_ptr<FileBytes> file, const std::string& path,
                                       const SourceDescription& source) {
  const std::string name = file->name();
  const auto named = [&](const std::string& sentence) { return fmt::format("{}: {}", name, sentence); };
  MrcHeader header;
  try {
    header = parse_mrc_header(file->peek(mrc_header_bytes));
  } catch (const BrokenInput& broken) {
    throw BrokenInput(named(broken.what()));
  }
  SourceFacts facts;
  facts.info = header.info;
  facts.files = {path};
  for (const std::string& warning : header.warnings) facts.warnings.push_back(named(warning));
  for (const std::string& sentence : header.not_understood) facts.not_understood.push_back(named(sentence));
  facts.holds_other_bytes = true;  // the header says more than the file that is made
  facts.missing_of_voxel_size = missing_of_voxel_size(facts.info.geometry(), true);
  const auto number = wanted_volume(source, name, facts.info, header.volumes);
  const std::uint64_t bytes = *sample_bytes(facts.info.dims, facts.info.type);
  SamplesPlace place{.start = header.start + static_cast<std::uint64_t>(number.value_or(0)) * bytes,
                     .big_endian = header.big_endian};
  if (!number) take_all_volumes(facts.info, header.volumes);
  if (number && *number + 1 < header.volumes)
    place.may_go_on = true;
  else
    allow_more(*file, place, facts);
  return plain_samples(std::move(facts), std::move(file), place);
}

}  // namespace tagrid
