#include "io/nifti/header.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <span>

#include "io/bytes/little_endian.h"
#include "io/files/errors.h"
#include "io/nifti/forms.h"
#include "io/nrrd/geometry.h"

namespace tagrid {
namespace {

using namespace std::string_view_literals;

/// Where a field is, and of which type: 'c' text, 'b' byte, 's', 'i', 'l' integers of 2, 4, 8 bytes, 'f', 'd' floats.
struct Place {
  std::size_t at = 0;
  char type = 0;
};

/// A field of both versions, and how many numbers or bytes it has.
struct Field {
  std::string_view name;
  Place first, second;
  std::size_t count = 1;
};

constexpr Field dim{"dim", {40, 's'}, {16, 'l'}, 8};
constexpr Field datatype{"datatype", {70, 's'}, {12, 's'}};
constexpr Field vox_offset{"vox_offset", {108, 'f'}, {168, 'l'}};
constexpr Field pixdim{"pixdim", {76, 'f'}, {104, 'd'}, 8};
constexpr Field scl_slope{"scl_slope", {112, 'f'}, {176, 'd'}};
constexpr Field scl_inter{"scl_inter", {116, 'f'}, {184, 'd'}};
constexpr Field xyzt_units{"xyzt_units", {123, 'b'}, {500, 'i'}};
constexpr Field qform_code{"qform_code", {252, 's'}, {344, 'i'}};
constexpr Field sform_code{"sform_code", {254, 's'}, {348, 'i'}};
constexpr Field quatern{"quatern_bcd", {256, 'f'}, {352, 'd'}, 3};
constexpr Field qoffset{"qoffset_xyz", {268, 'f'}, {376, 'd'}, 3};
constexpr std::array srow = {Field{"srow_x", {280, 'f'}, {400, 'd'}, 4},
                             Field{"srow_y", {296, 'f'}, {432, 'd'}, 4},
                             Field{"srow_z", {312, 'f'}, {464, 'd'}, 4}};

/// What is kept as pairs, in this order, unless all of it is 0.
constexpr std::array kept = {Field{"descrip", {148, 'c'}, {240, 'c'}, 80},
                             Field{"aux_file", {228, 'c'}, {320, 'c'}, 24},
                             Field{"intent_name", {328, 'c'}, {508, 'c'}, 16},
                             Field{"intent_code", {68, 's'}, {504, 'i'}},
                             Field{"intent_p1_p2_p3", {56, 'f'}, {80, 'd'}, 3},
                             Field{"dim_info", {39, 'b'}, {524, 'b'}},
                             pixdim,
                             scl_slope,
                             scl_inter,
                             Field{"cal_min", {128, 'f'}, {200, 'd'}},
                             Field{"cal_max", {124, 'f'}, {192, 'd'}},
                             Field{"slice_start", {74, 's'}, {224, 'l'}},
                             Field{"slice_end", {120, 's'}, {232, 'l'}},
                             Field{"slice_code", {122, 'b'}, {496, 'i'}},
                             Field{"slice_duration", {132, 'f'}, {208, 'd'}},
                             Field{"toffset", {136, 'f'}, {216, 'd'}},
                             xyzt_units,
                             qform_code,
                             quatern,
                             qoffset,
                             sform_code,
                             srow[0],
                             srow[1],
                             srow[2]};

enum class Magic { none, first, first_pair, second, second_pair };

Magic magic_of(std::string_view bytes) {
  if (bytes.size() >= 348 && (bytes.starts_with("\x5c\1\0\0"sv) || bytes.starts_with("\0\0\1\x5c"sv))) {
    const std::string_view magic = bytes.substr(344, 4);
    if (magic == "n+1\0"sv) return Magic::first;
    if (magic == "ni1\0"sv) return Magic::first_pair;
  }
  if (bytes.size() >= 12 && (bytes.starts_with("\x1c\2\0\0"sv) || bytes.starts_with("\0\0\2\x1c"sv))) {
    const std::string_view magic = bytes.substr(4, 8);
    if (magic == "n+2\0\r\n\032\n"sv) return Magic::second;
    if (magic == "ni2\0\r\n\032\n"sv) return Magic::second_pair;
  }
  return Magic::none;
}

/// The fields of a header, in either version and byte order.
class Fields {
 public:
  Fields(std::string_view bytes, bool is_second)
      : bytes_(bytes), is_second_(is_second), is_big_endian_(bytes[0] == '\0') {}

  bool is_big_endian() const { return is_big_endian_; }

  double number(const Field& field, std::size_t i = 0) const {
    const Place& place = place_of(field);
    switch (place.type) {
      case 'b':
        return load<std::uint8_t>(place.at + i);
      case 's':
        return load<std::int16_t>(place.at + i * 2);
      case 'i':
        return load<std::int32_t>(place.at + i * 4);
      case 'l':
        return static_cast<double>(load<std::int64_t>(place.at + i * 8));
      case 'f':
        return load<float>(place.at + i * 4);
      default:
        return load<double>(place.at + i * 8);
    }
  }
  std::int64_t integer(const Field& field, std::size_t i = 0) const {
    const Place& place = place_of(field);
    return place.type == 'l' ? load<std::int64_t>(place.at + i * 8)
                             : static_cast<std::int64_t>(number(field, i));
  }
  template <std::size_t n>
  std::array<double, n> numbers(const Field& field) const {
    std::array<double, n> values;
    for (std::size_t i = 0; i < n; ++i) values[i] = number(field, i);
    return values;
  }
  /// "" if all of it is 0.
  std::string text(const Field& field) const {
    if (place_of(field).type == 'c') {
      const std::string_view text = bytes_.substr(place_of(field).at, field.count);
      return std::string(text.substr(0, text.find('\0')));
    }
    std::string text;
    bool is_zero = true;
    for (std::size_t i = 0; i < field.count; ++i) {
      is_zero = is_zero && number(field, i) == 0;
      text += fmt::format("{}{}", i > 0 ? " " : "", number(field, i));
    }
    return is_zero ? "" : text;
  }

 private:
  const Place& place_of(const Field& field) const { return is_second_ ? field.second : field.first; }
  template <class T>
  T load(std::size_t at) const {
    std::array<std::byte, sizeof(T)> bytes;
    std::memcpy(bytes.data(), bytes_.data() + at, sizeof(T));
    if (is_big_endian_) std::ranges::reverse(bytes);
    return load_little_endian<T>(bytes.data());
  }

  std::string_view bytes_;
  bool is_second_, is_big_endian_;
};

SampleType type_of(std::int64_t code) {
  switch (code) {
    case 2:
      return SampleType::uint8;
    case 4:
      return SampleType::int16;
    case 8:
      return SampleType::int32;
    case 16:
      return SampleType::float32;
    case 64:
      return SampleType::float64;
    case 256:
      return SampleType::int8;
    case 512:
      return SampleType::uint16;
    case 768:
      return SampleType::uint32;
    default:
      break;
  }
  const char* name = code == 1                                    ? "single bits"
                     : code == 32 || code == 1792 || code == 2048 ? "complex numbers"
                     : code == 128 || code == 2304                ? "colors"
                     : code == 1024 || code == 1280               ? "integers of 64 bits"
                     : code == 1536                               ? "floats of 128 bits"
                                                                  : "of no known type";
  throw BrokenInput(
      fmt::format("NIfTI header: samples are {} (datatype {}), which are not supported", name, code));
}

/// The samples of one volume along x, y, z, and the number of volumes.
std::pair<Index3, std::int64_t> dims_of(const Fields& fields) {
  const std::int64_t axes = fields.integer(dim);
  if (axes < 1 || axes > 7)
    throw BrokenInput(fmt::format("NIfTI header: dim[0], the number of axes, is {}, not 1 to 7", axes));
  std::array<std::int64_t, 8> sizes = {};
  std::int64_t volumes = 1;
  for (std::size_t i = 1; i < 8; ++i) {
    sizes[i] = static_cast<std::int64_t>(i) <= axes ? fields.integer(dim, i) : 1;
    if (sizes[i] < 1) throw BrokenInput(fmt::format("NIfTI header: dim[{}] is {}", i, sizes[i]));
    if (i > 3 && __builtin_mul_overflow(volumes, sizes[i], &volumes))
      throw BrokenInput("NIfTI header: there are too many volumes");
  }
  return {{sizes[1], sizes[2], sizes[3]}, volumes};
}

std::string unit_of(const Fields& fields) {
  switch (fields.integer(xyzt_units) & 7) {
    case 1:
      return "m";
    case 2:
      return "mm";
    case 3:
      return "um";
    default:
      return "";
  }
}

bool spans_a_volume(const Geometry& geometry) {
  for (const auto& direction : geometry.directions)
    for (const double number : direction)
      if (!std::isfinite(number)) return false;
  for (const double number : geometry.origin)
    if (!std::isfinite(number)) return false;
  const double volume = determinant(geometry.directions);
  return std::isfinite(volume) && volume != 0;
}

Geometry geometry_of_sform(const Fields& fields) {
  Geometry geometry;
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      geometry.directions[axis][row] = fields.number(srow[row], axis);
    geometry.origin[row] = fields.number(srow[row], 3);
  }
  return geometry;
}

Geometry geometry_of_qform(const Fields& fields) {
  return tagrid::geometry_of_qform(fields.numbers<3>(quatern), fields.numbers<3>(qoffset),
                                   fields.numbers<4>(pixdim));
}

Geometry geometry_of_fields(const Fields& fields, std::vector<std::string>& warnings) {
  Geometry geometry;
  const auto is_good = [&](const Field& code, Geometry (*form)(const Fields&)) {
    if (fields.integer(code) <= 0) return false;
    geometry = form(fields);
    if (spans_a_volume(geometry)) return true;
    warnings.push_back(
        fmt::format("NIfTI header: the {} does not span a volume, and is not used", code.name.substr(0, 5)));
    return false;
  };
  if (is_good(sform_code, geometry_of_sform) || is_good(qform_code, geometry_of_qform)) {
    geometry.has_directions = geometry.has_origin = true;
    geometry.space = "right-anterior-superior";
  } else {
    geometry = {};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double size = std::abs(fields.number(pixdim, axis + 1));
      const bool is_known = std::isfinite(size) && size > 0;
      geometry.spacing[axis] = is_known ? size : Geometry::unknown;
      geometry.has_spacing = geometry.has_spacing || is_known;
    }
  }
  geometry.units.fill(unit_of(fields));
  return geometry;
}

Rescale rescale_of(const Fields& fields) {
  const double slope = fields.number(scl_slope), intercept = fields.number(scl_inter);
  // "If scl_slope is 0, there is no scaling"; files in use have NaN as well.
  if (slope == 0 || !std::isfinite(slope) || !std::isfinite(intercept)) return {};
  return {slope, intercept, ""};
}

std::uint64_t offset_of(const Fields& fields, bool is_pair, std::size_t header_bytes) {
  const double offset = fields.number(vox_offset);
  const double least = is_pair ? 0 : static_cast<double>(header_bytes);
  // A file of one part without an offset has its samples right after the header.
  if (offset == 0 && !is_pair) return header_bytes + 4;
  if (!(offset >= least && offset <= 0x1p62) || offset != std::floor(offset))
    throw BrokenInput(fmt::format("NIfTI header: vox_offset is {}, where no samples can begin", offset));
  return static_cast<std::uint64_t>(offset);
}

}  // namespace

bool begins_nifti(std::string_view bytes) { return magic_of(bytes) != Magic::none; }

NiftiHeader parse_nifti_header(std::string_view bytes) {
  const Magic magic = magic_of(bytes);
  const bool is_second = magic == Magic::second || magic == Magic::second_pair;
  const std::size_t header_bytes = is_second ? 540 : 348;
  if (magic == Magic::none || bytes.size() < header_bytes)
    throw BrokenInput("the NIfTI header is not complete");
  const Fields fields(bytes, is_second);
  const auto [dims, volumes] = dims_of(fields);
  NiftiHeader header;
  header.big_endian = fields.is_big_endian();
  header.is_pair = magic == Magic::first_pair || magic == Magic::second_pair;
  header.offset = offset_of(fields, header.is_pair, header_bytes);
  header.volumes = volumes;
  header.rescale = rescale_of(fields);
  const SampleType type = type_of(fields.integer(datatype));
  const auto volume_bytes = sample_bytes(dims, type);
  std::uint64_t all = 0;
  if (!volume_bytes || __builtin_mul_overflow(*volume_bytes, static_cast<std::uint64_t>(volumes), &all) ||
      all > std::uint64_t{1} << 62)
    throw BrokenInput(
        fmt::format("NIfTI header: {} volumes of {} are beyond all memory", volumes, described(dims, type)));
  KeyValues pairs;
  for (const Field& field : kept)
    if (std::string text = fields.text(field); !text.empty())
      pairs.emplace_back(fmt::format("nifti_{}", field.name), std::move(text));
  add_rescale(header.rescale, pairs);
  header.info = volume_info(dims, type, nrrd_fields_of(geometry_of_fields(fields, header.warnings), pairs));
  return header;
}

}  // namespace tagrid
