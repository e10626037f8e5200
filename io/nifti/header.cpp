#include "io/nifti/header.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>
#include <span>

#include "io/bytes/little_endian.h"
#include "io/files/errors.h"
#include "io/files/foreign_number.h"
#include "io/nrrd/foreign_spacing.h"
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
constexpr Field intent_code{"intent_code", {68, 's'}, {504, 'i'}};
constexpr Field bitpix{"bitpix", {72, 's'}, {14, 's'}};
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
                             intent_code,
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

/// "METHOD 2" of the standard: a rotation as a quaternion, and pixdim[0] mirrors z.
Geometry geometry_of_qform(const Fields& fields) {
  const auto [b, c, d] = fields.numbers<3>(quatern);
  const double rest = 1 - (b * b + c * c + d * d);
  const double a = rest > 0 ? std::sqrt(rest) : 0;
  // With a = 0, the other three are to have the length 1.
  const double length = rest > 0 ? 1 : std::sqrt(b * b + c * c + d * d);
  const double i = b / length, j = c / length, k = d / length;
  const std::array<std::array<double, 3>, 3> rotation = {
      {{a * a + i * i - j * j - k * k, 2 * (i * j - a * k), 2 * (i * k + a * j)},
       {2 * (i * j + a * k), a * a + j * j - i * i - k * k, 2 * (j * k - a * i)},
       {2 * (i * k - a * j), 2 * (j * k + a * i), a * a + k * k - i * i - j * j}}};
  Geometry geometry;
  const auto sizes = fields.numbers<4>(pixdim);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // Only pixdim[0] mirrors. The others must be positive; readers take a negative one for its absolute value.
    const double size = std::abs(sizes[axis + 1]) * (axis == 2 && sizes[0] < 0 ? -1 : 1);
    for (std::size_t row = 0; row < 3; ++row) geometry.directions[axis][row] = rotation[row][axis] * size;
  }
  geometry.origin = fields.numbers<3>(qoffset);
  return geometry;
}

/// A way in which a header says where a volume lies.
struct Form {
  std::string_view name;
  const Field* code;
  Geometry (*geometry)(const Fields& fields);
  std::vector<const Field*> said_by;
};

/// "srow_x 1 0 0 5, srow_y 0 1 0 5", for messages.
std::string text_of(const Fields& fields, const std::vector<const Field*>& names) {
  std::string text;
  for (const Field* field : names) {
    const std::string value = fields.text(*field);
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", field->name, value.empty() ? "0" : value);
  }
  return text;
}

/// The geometry of the form; nothing if the header has it not, or if it cannot be used, which a warning says then.
std::optional<Geometry> geometry_of_form(const Form& form, const Fields& fields,
                                         std::vector<std::string>& warnings) {
  if (fields.integer(*form.code) <= 0) return std::nullopt;
  Geometry geometry = form.geometry(fields);
  if (!spans_a_volume(geometry)) {
    warnings.push_back(fmt::format("NIfTI header: the {} does not span a volume, and is not used: {}",
                                   form.name, text_of(fields, form.said_by)));
    return std::nullopt;
  }
  geometry.has_directions = geometry.has_origin = true;
  geometry.space = "right-anterior-superior";
  if (!std::ranges::all_of(geometry.origin, [](double number) { return std::isfinite(number); })) {
    warnings.push_back(
        fmt::format("NIfTI header: the position in the {} is not a number, and where the volume "
                    "lies is unknown: {}",
                    form.name, text_of(fields, form.said_by)));
    geometry.has_origin = false;
    geometry.origin = {};
  }
  return geometry;
}

/// The sizes of voxels, of which those along axes of one sample say nothing.
Geometry geometry_of_pixdim(const Fields& fields, const Index3& dims, std::vector<std::string>& warnings) {
  std::vector<ForeignNumber> sizes;
  std::vector<std::string> names;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // "pixdim must be positive": other readers take a negative one for its absolute value, too.
    const double size = std::abs(fields.number(pixdim, axis + 1));
    const bool says_nothing = !(size > 0) && dims[static_cast<int>(axis)] == 1;
    sizes.push_back(says_nothing ? ForeignNumber() : foreign_number(size));
    names.push_back(fmt::format("NIfTI header: pixdim[{}]", axis + 1));
  }
  Geometry geometry;
  set_spacing(sizes, names, NegativeSpacing::is_unknown, geometry, warnings);
  return geometry;
}

void check_signs(const Fields& fields, std::vector<std::string>& warnings) {
  for (std::size_t axis = 1; axis <= 3; ++axis)
    if (const double size = fields.number(pixdim, axis); size < 0)
      warnings.push_back(fmt::format("NIfTI header: pixdim[{}], the size of voxels, is {}; it is read as {}",
                                     axis, size, -size));
}

Geometry geometry_of_fields(const Fields& fields, const Index3& dims, std::vector<std::string>& warnings) {
  const Form sform{"sform", &sform_code, geometry_of_sform, {&srow[0], &srow[1], &srow[2]}};
  const Form qform{"qform", &qform_code, geometry_of_qform, {&quatern, &qoffset, &pixdim}};
  auto geometry = geometry_of_form(sform, fields, warnings);
  if (!geometry) {
    check_signs(fields, warnings);
    geometry = geometry_of_form(qform, fields, warnings);
  }
  if (!geometry) geometry = geometry_of_pixdim(fields, dims, warnings);
  if (const auto unit = fields.integer(xyzt_units) & 7; unit > 3)
    warnings.push_back(fmt::format("NIfTI header: xyzt_units has the unit {}, which is not known", unit));
  geometry->units.fill(unit_of(fields));
  return *geometry;
}

/// "If scl_slope is 0, there is no scaling"; files in use have NaN for that as well.
Rescale rescale_of(const Fields& fields, NiftiHeader& header) {
  const double slope = fields.number(scl_slope), intercept = fields.number(scl_inter);
  const bool has_none = slope == 0 || std::isnan(slope);
  if (!std::isfinite(slope) && !(has_none && (intercept == 0 || std::isnan(intercept))))
    header.scale_doubt = fmt::format(
        "NIfTI header: scl_slope is {}, which is not a number, and scl_inter is {}; what values samples mean "
        "is "
        "unknown",
        slope, intercept);
  if (has_none || std::isinf(slope)) return {};
  if (std::isinf(intercept))
    header.scale_doubt = fmt::format(
        "NIfTI header: scl_slope is {}, and scl_inter {}, which is not a number; what "
        "values samples mean is unknown",
        slope, intercept);
  else if (const std::string remark = remark_on(foreign_number(intercept), "scl_inter", "it counts as 0");
           !remark.empty())
    header.warnings.push_back(fmt::format("NIfTI header: {}; scl_slope is {}", remark, slope));
  return {slope, std::isfinite(intercept) ? intercept : 0, ""};
}

/// What samples are if they are no measurements; "" for all others.
std::string_view meaning_of(std::int64_t intent) {
  switch (intent) {
    case 1002:
    case 1003:
      return "labels";
    case 1004:
    case 1005:
      return "parts of matrices";
    case 1006:
    case 1007:
      return "parts of vectors";
    case 1008:
      return "points";
    case 1009:
      return "triangles";
    case 1010:
      return "parts of quaternions";
    case 2003:
    case 2004:
      return "parts of colors";
    default:
      return "";
  }
}

void check_meaning(const Fields& fields, SampleType type, NiftiHeader& header) {
  const std::int64_t intent = fields.integer(intent_code), bits = fields.integer(bitpix);
  if (const std::string_view meaning = meaning_of(intent); !meaning.empty())
    header.not_understood.push_back(
        fmt::format("NIfTI header: intent_code {} says that samples are {}; they are taken for measurements",
                    intent, meaning));
  const auto bits_of_type = static_cast<std::int64_t>(8 * size_of(type));
  if (bits != bits_of_type)
    header.not_understood.push_back(fmt::format(
        "NIfTI header: bitpix is {}, but samples of datatype {} have {} bits; the datatype counts", bits,
        fields.integer(datatype), bits_of_type));
}

std::uint64_t offset_of(const Fields& fields, bool is_pair, std::size_t header_bytes) {
  const double offset = fields.number(vox_offset);
  // Four bytes that announce extensions follow the header of a file of one part. Without an offset, samples follow them.
  const auto least = static_cast<double>(is_pair ? 0 : header_bytes + 4);
  if (offset == 0) return is_pair ? 0 : header_bytes + 4;
  if (!(offset >= least && offset <= 0x1p62) || offset != std::floor(offset))
    throw BrokenInput(fmt::format(
        "NIfTI header: vox_offset is {}, where no samples can begin: it must be a whole number from {} on",
        offset, least));
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
  if (!header.is_pair && fields.number(vox_offset) == 0)
    header.warnings.push_back(fmt::format(
        "NIfTI header: vox_offset is 0, within the header; samples are read from byte {} on", header.offset));
  header.volumes = volumes;
  header.rescale = rescale_of(fields, header);
  const SampleType type = type_of(fields.integer(datatype));
  check_meaning(fields, type, header);
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
  header.info =
      volume_info(dims, type, nrrd_fields_of(geometry_of_fields(fields, dims, header.warnings), pairs));
  return header;
}

}  // namespace tagrid
